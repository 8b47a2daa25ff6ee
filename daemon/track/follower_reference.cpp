// The reference of a follower: a zero, or the first picture in its place; and the appearance of the markers.
#include "base/quantile.h"
#include "daemon/track/appearance.h"
#include "daemon/track/follower.h"
#include "daemon/track/rest_pose.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tractiond::track {

void Follower::adopt(const RestPose& pose) {
  for (int i = 0; i < markers_; ++i) {
    reference_.place_px[i] = {pose.position_px[2 * i], pose.position_px[2 * i + 1]};
    displacement_[i] = place_[i] - reference_.place_px[i];
  }
  reference_.amplitude = pose.amplitude;
  reference_.present = pose.present;
  reference_.isolatedGaps = 0;
  for (const Layer& layer : layers_) reference_.isolatedGaps += isolatedGaps(layer.lattice, reference_.present);
  errors_.adopt(pose);
  reference_.isZero = true;
  tears_.forget();
}

void Follower::setCrossTalk(const RestPose& pose) {
  for (const Layer& layer : layers_) {
    appearanceOf(layer).crossTalk = {pose.crossTalk[static_cast<std::size_t>(1 - layer.rank)],
                                     pose.crossTalk[static_cast<std::size_t>(layer.rank)]};
  }
}

void Follower::exchangeAppearance(Appearance& other) {
  std::swap(reference_.appearance, other);
  errors_.forgetShape();
  newAppearance_ = true;
}

void Follower::learnAnew() {
  reference_.appearance.isKnown = false;
  seeksAll_ = reference_.isZero;
  acquireIn_ = 0;
}

const MarkerTemplate& Follower::roughOf(Layer& layer) {
  if (layer.roughScale != layer.plane.scale) {
    layer.rough = roughTemplate(layer.plane, appearanceOf(layer).radius_px);
    layer.roughScale = layer.plane.scale;
  }
  return layer.rough;
}

/// Scales the radius with the pattern: the camera may be nearer or farther than described.
void Follower::learnSize(const Layer& layer, std::span<const std::uint8_t> seen) {
  const Lattice& lattice = layer.lattice;
  float shown = 0.0F, described = 0.0F;
  const auto add = [&](int one, int other) {
    if (!seen[one] || !seen[other]) return;
    shown += std::sqrt((place_[other] - place_[one]).squared());
    described += std::sqrt((nominal_[other] - nominal_[one]).squared());
  };
  for (int row = 0; row + 1 < lattice.rows; ++row) {
    for (int column = 0; column + 1 < lattice.columns; ++column) {
      const int node = lattice.at(column, row);
      add(node, node + 1);
      add(node, node + lattice.columns);
    }
  }
  if (described > 0.0F) appearanceOf(layer).radius_px = layer.described_px * static_cast<double>(shown / described);
}

/// Learns from the markers that are `seen`, at their present places.
void Follower::learnAppearance(std::span<const std::uint8_t> seen) {
  for (Layer& layer : layers_) {
    learnSize(layer, seen);
    appearanceOf(layer).markers = {roughTemplate(layer.plane, appearanceOf(layer).radius_px)};
  }
  markOverlaps();
  const auto places = [&](const Layer& layer, bool unseen) {
    std::vector<Guess> all;
    for (int i = layer.lattice.first; i < layer.lattice.first + layer.lattice.count(); ++i) {
      if (unseen || seen[i]) all.push_back({place_[i].u, place_[i].v, layer.plane.unit, mixed_[i] != 0});
    }
    return all;
  };
  if ((!reference_.isZero || seeksAll_) && workspace_->planes.mixes()) {
    for (std::size_t i = 0; i < 2; ++i) {
      Layer &own = layers_[i], &other = layers_[1 - i];
      appearanceOf(own).crossTalk.own = appearanceOf(other).crossTalk.other =
          crossTalkInto(own.plane, own.otherPlane, appearanceOf(own).markers.front(), places(own, false));
    }
  }
  for (Layer& layer : layers_) {
    // Markers that differ too much from the others to be found may be present nevertheless.
    const auto first = static_cast<std::size_t>(layer.lattice.first),
               count = static_cast<std::size_t>(layer.lattice.count());
    const auto sizes = fitSizes(layer.plane, appearanceOf(layer), places(layer, true), seen.subspan(first, count));
    std::ranges::copy(sizes, reference_.appearance.size.begin() + layer.lattice.first);
  }
  reference_.appearance.isKnown = true;
}

/// Interpolates the places of markers without a spot from those around them.
void Follower::placeUnlabelled() {
  const std::vector<Vector>& reference = reference_.isZero ? reference_.place_px : nominal_;
  for (int i = 0; i < markers_; ++i) displacement_[i] = place_[i] - reference[i];
  for (const Layer& layer : layers_) {
    const Lattice& lattice = layer.lattice;
    for (int i = lattice.first; i < lattice.first + lattice.count(); ++i) {
      if (labelled_[i]) continue;
      const auto whole = expectation(lattice, i, displacement_, labelled_);
      place_[i] = whole ? reference[i] + *whole : reference[i];
    }
  }
}

/// Takes the first labelled picture as the reference until there is a rest pose.
void Follower::assumeRest() {
  for (Layer& layer : layers_) {
    const Lattice& lattice = layer.lattice;
    std::vector<float> amplitudes;
    for (const Spot& spot : layer.spots) amplitudes.push_back(spot.amplitude);
    const float typical = quantile(amplitudes);
    for (int i = lattice.first; i < lattice.first + lattice.count(); ++i) {
      reference_.place_px[i] = place_[i];
      reference_.amplitude[i] = typical;
      if (labelled_[i])
        reference_.amplitude[i] =
            std::max(amplitudeAt(layer.plane, appearanceOf(layer).markers[reference_.appearance.size[i]], place_[i].u,
                                 place_[i].v),
                     0.5F * typical);
    }
  }
  std::fill(reference_.present.begin(), reference_.present.end(), std::uint8_t{1});
}

}  // namespace tractiond::track
