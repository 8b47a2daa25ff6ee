#include "daemon/track/rest_pose.h"

#include "base/hash.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace tractiond::track {

Id idOf(const RestPose& pose) {
  const auto hashOf = [](const auto& values) { return hash128(values.data(), values.size() * sizeof values[0]); };
  const std::array<std::int64_t, 2> moment = {pose.taken_ns, pose.requested ? 1 : 0};
  const std::array<float, 5> levels = {pose.noise, pose.shotNoise, pose.light, pose.crossTalk[0], pose.crossTalk[1]};
  const std::array<Hash128, 6> parts = {hashOf(pose.position_px), hashOf(pose.amplitude), hashOf(pose.present),
                                        hashOf(levels),           hashOf(moment),         hashOf(pose.oddity)};
  // Poses of versions without oddities keep their ids.
  return hashOf(std::span(parts).first(pose.oddity.empty() ? 5 : 6));
}

bool isSane(const RestPose& pose) {
  const auto finite = [](float value) { return std::isfinite(value); };
  return std::all_of(pose.position_px.begin(), pose.position_px.end(), finite) &&
         std::all_of(pose.amplitude.begin(), pose.amplitude.end(), finite) &&
         std::all_of(pose.present.begin(), pose.present.end(), [](std::uint8_t present) { return present <= 1; }) &&
         (pose.oddity.empty() || pose.oddity.size() == pose.amplitude.size()) &&
         std::all_of(pose.oddity.begin(), pose.oddity.end(),
                     [](float share) { return share >= 0.0F && share <= 1e3F; }) &&
         finite(pose.noise) && pose.noise > 0.0F && finite(pose.light) && finite(pose.shotNoise) &&
         pose.shotNoise >= 0.0F;
}

}  // namespace tractiond::track
