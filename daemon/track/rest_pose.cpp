#include "daemon/track/rest_pose.h"

#include "daemon/base/hash.h"

namespace tractiond::track {

Id idOf(const RestPose& pose) {
  const auto hashOf = [](const auto& values) { return hash128(values.data(), values.size() * sizeof values[0]); };
  const std::array<std::int64_t, 2> moment = {pose.taken_ns, pose.requested ? 1 : 0};
  const std::array<float, 5> levels = {pose.noise, pose.shotNoise, pose.light, pose.crossTalk[0], pose.crossTalk[1]};
  const std::array<Hash128, 5> parts = {hashOf(pose.position_px), hashOf(pose.amplitude), hashOf(pose.present),
                                        hashOf(levels), hashOf(moment)};
  return hashOf(parts);
}

}  // namespace tractiond::track
