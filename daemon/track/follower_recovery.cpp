// Handles markers that were not found at their expected places: searches them where their neighbours suggest, rejects
// those that another marker hides, and interpolates the places of lost ones from their neighbours.
#include "daemon/track/follower.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace tractiond::track {

namespace {

constexpr float kSearchReach = 0.4F;  // share of the spacing
constexpr float kSearchReach_px = 8.0F;
constexpr int kPatience = 8;  // frames with a wide search for a marker; afterwards only every sixteenth
constexpr int kSweeps = 40;
constexpr float kBlurredRim_px = 1.2F;     // beyond a disc's radius
constexpr float kOverlapMotion_px = 2.0F;  // largest approach of two colours from frame to frame

int validNeighbours(const Lattice& lattice, int marker, const std::vector<std::uint8_t>& valid) {
  const int column = (marker - lattice.first) % lattice.columns, row = (marker - lattice.first) / lattice.columns;
  int count = 0;
  for (int y = std::max(row - 1, 0); y <= std::min(row + 1, lattice.rows - 1); ++y) {
    for (int x = std::max(column - 1, 0); x <= std::min(column + 1, lattice.columns - 1); ++x) {
      count += valid[lattice.at(x, y)];
    }
  }
  return count - valid[marker];
}

}  // namespace

void Follower::recover() {
  for (const Layer& layer : layers_) {
    const Lattice& lattice = layer.lattice;
    lost_.clear();
    for (int i = lattice.first; i < lattice.first + lattice.count(); ++i) {
      if (valid_[i] || !wanted(i)) continue;
      lost_.push_back(i);
      attempts_[i] = 0;
    }
    // Starts with markers that have several found neighbours; tries a marker again only when it has more of them.
    int enough = 3;
    for (int sweep = 0; sweep < kSweeps && enough > 0 && !lost_.empty(); ++sweep) {
      bool progress = false;
      for (const int marker : lost_) {
        if (valid_[marker]) continue;
        const int neighbours = validNeighbours(lattice, marker, valid_);
        if (neighbours < enough || neighbours <= attempts_[marker]) continue;
        attempts_[marker] = static_cast<std::uint8_t>(neighbours);
        progress = recoverOne(layer, marker) || progress;
      }
      if (!progress) --enough;
    }
  }
}

bool Follower::recoverOne(const Layer& layer, int marker) {
  Vector place = place_[marker];
  const auto step = expectation(layer.lattice, marker, increment_, stepped_);
  const auto whole = expectation(layer.lattice, marker, displacement_, valid_);
  if (wasValid_[marker] && step) {
    place = previous_[marker] + *step;
    if (fitAt(layer, marker, place)) return true;
  }
  if (whole) {
    place = reference_.place_px[marker] + *whole;
    if (fitAt(layer, marker, place)) return true;
  }
  const bool patient = lostFor_[marker] < kPatience || (frames_ + static_cast<unsigned>(marker)) % 16 == 0;
  if (searches_ == 0 || !patient) return false;
  --searches_;
  return searchAround(layer, marker, place);
}

bool Follower::searchAround(const Layer& layer, int marker, Vector place) {
  constexpr int kMostSteps = 4;
  constexpr int kMost = (2 * kMostSteps + 1) * (2 * kMostSteps + 1);
  const float reach = std::min(kSearchReach * spacing_px_, kSearchReach_px);
  const auto radius_px = static_cast<float>(appearanceOf(layer).radius_px);
  const int steps = std::min(kMostSteps, static_cast<int>(std::ceil(reach / (1.3F * radius_px))));
  std::array<Guess, kMost> guesses;
  std::array<Centre, kMost> centres;
  std::size_t count = 0;
  const float step = reach / static_cast<float>(steps);
  for (int y = -steps; y <= steps; ++y) {
    for (int x = -steps; x <= steps; ++x) {
      guesses[count++] = guessAt(marker, place + step * Vector{static_cast<float>(x), static_cast<float>(y)});
    }
  }
  fit(layer, std::span(guesses).first(count), std::span(centres).first(count));
  // Takes the nearest one, if no other is almost as near.
  std::sort(centres.begin(), centres.begin() + static_cast<std::ptrdiff_t>(count),
            [&](const Centre& a, const Centre& b) {
              return (Vector{a.u, a.v} - place).squared() < (Vector{b.u, b.v} - place).squared();
            });
  for (std::size_t i = 0; i < count; ++i) {
    if (!accept(marker, centres[i], place)) continue;
    const Vector found = place_[marker];
    const float distance = std::sqrt((found - place).squared());
    for (std::size_t k = i + 1; k < count; ++k) {
      const Vector other{centres[k].u, centres[k].v};
      if (!centres[k].found || centres[k].amplitude < kDim * reference_.amplitude[marker]) continue;
      if ((other - found).squared() < radius_px * radius_px) continue;
      if (std::sqrt((other - place).squared()) < distance + 0.25F * spacing_px_) {
        valid_[marker] = stepped_[marker] = 0;
        return false;
      }
    }
    return fitAt(layer, marker, found);  // now with its own slope
  }
  return false;
}

void Follower::markOverlaps() {
  if (layers_.size() < 2) return;
  const Layer& front = layers_[layers_[0].nearer ? 0 : 1];
  const Layer& back = layers_[layers_[0].nearer ? 1 : 0];
  workspace_->grid.clear();
  for (int i = front.lattice.first; i < front.lattice.first + front.lattice.count(); ++i) {
    mixed_[i] = 0;
    if (reference_.present[i]) workspace_->grid.add(i, place_[i].u, place_[i].v);
  }
  const auto reachOf = [this](const Layer& layer) {
    return static_cast<float>(appearanceOf(layer).radius_px) + kBlurredRim_px;
  };
  const auto windowOf = [this](const Layer& layer) {
    int half = 0;
    for (const MarkerTemplate& marker : appearanceOf(layer).markers) half = std::max(half, marker.half());
    return static_cast<float>(half) * layer.plane.scale;
  };
  const float backWindow = windowOf(back), frontWindow = windowOf(front);
  const float backReach = reachOf(back) + kOverlapMotion_px, frontReach = reachOf(front) + kOverlapMotion_px;
  const float hides = static_cast<float>(appearanceOf(front).radius_px + appearanceOf(back).radius_px) + kBlurredRim_px;
  const float farthest = std::max(backWindow + frontReach, frontWindow + backReach);
  const auto overlaps = [](float window, float reach, float du, float dv) {
    const float u = std::max(std::abs(du) - window, 0.0F), v = std::max(std::abs(dv) - window, 0.0F);
    return u * u + v * v < reach * reach;
  };
  for (int i = back.lattice.first; i < back.lattice.first + back.lattice.count(); ++i) {
    mixed_[i] = 0;
    workspace_->grid.near(place_[i].u, place_[i].v, farthest, [&](int other) {
      const Vector offset = place_[other] - place_[i];
      if (overlaps(backWindow, frontReach, offset.u, offset.v)) mixed_[i] = 1;
      if (overlaps(frontWindow, backReach, offset.u, offset.v)) mixed_[other] = 1;
      if (offset.squared() < hides * hides) valid_[i] = stepped_[i] = 0;
    });
  }
}

void Follower::guessLost() {
  for (const Layer& layer : layers_) {
    const Lattice& lattice = layer.lattice;
    for (int i = lattice.first; i < lattice.first + lattice.count(); ++i) {
      if (stepped_[i] && valid_[i]) {
        velocity_[i] = increment_[i];
        lostFor_[i] = 0;
        continue;
      }
      if (!wanted(i)) continue;
      stepped_[i] = 0;
      const auto step = expectation(lattice, i, increment_, stepped_);
      velocity_[i] = step ? *step : Vector{};
      if (valid_[i]) {
        lostFor_[i] = 0;
        continue;
      }
      ++lostFor_[i];
      const auto whole = expectation(lattice, i, displacement_, valid_);
      if (whole) place_[i] = reference_.place_px[i] + *whole;
    }
  }
}

}  // namespace tractiond::track
