// The motion since the last intact frame is smooth, as the gel is continuous; a tear is a step from one row of markers
// to the next. The fifth difference along a column, (-1, 5, -10, 10, -5, 1) / 6 over three rows on either side, is the
// full height of a step, and small for a smooth motion of any speed. A gap between two rows is a step if the sum of the
// fifth differences over all columns is too large for noise, and not much smaller than the plain differences there and
// in the gaps beside it: for loads on the surface it has at most 27 % of their energy, and 9 % in both layers at the
// same height; for tears 47 % and more. If a step is so large that the markers are lost, whole rows vanish at once.
#include "daemon/track/tear_finder.h"

#include <algorithm>
#include <cmath>

namespace tractiond::track {

namespace {

constexpr int kReach = 3;                     // rows on either side of a gap
constexpr float kNoiseGain = 252.0F / 36.0F;  // squared weights of the fifth difference
constexpr int kLeastColumns = 4;              // columns that have all six markers
constexpr float kDeviations = 8.0F;           // of the sum over the columns from its expectation by noise
// Share of the energy of the plain differences. A row that is cut through shows less of the step.
constexpr float kFaint = 0.15F, kClear = 0.35F, kPlain = 0.6F;
constexpr float kLeast_px2 = 0.01F;          // squared step, mean over the columns; smaller ones are harmless
constexpr int kMostRunning = 3;              // torn frames in a row; after more the picture has changed permanently
constexpr float kSeen = 0.8F, kLost = 0.2F;  // shares of the markers seen on the two sides

}  // namespace

TearFinder::TearFinder(const std::vector<Lattice>& lattices)
    : lattices_(lattices) {
  const auto count = static_cast<std::size_t>(lattices.back().first + lattices.back().count());
  for (auto* vectors : {&reference_, &increment_}) vectors->resize(count);
  referenceVariance_.resize(count);
  referenceValid_.resize(count);
  for (const Lattice& lattice : lattices) rows_ = std::max(rows_, lattice.rows);
  steps_.resize(lattices.size() * static_cast<std::size_t>(rows_));
}

bool TearFinder::torn(std::span<const Vector> displacement_px, std::span<const float> variance_px2,
                      std::span<const std::uint8_t> valid) {
  bool torn = false;
  if (known_) {
    for (std::size_t i = 0; i < increment_.size(); ++i) increment_[i] = displacement_px[i] - reference_[i];
    for (const Lattice& lattice : lattices_) {
      markSteps(lattice, variance_px2, valid);
      torn = torn || losesRows(lattice, valid);
    }
    torn = torn || anyStep();
  }
  running_ = torn ? running_ + 1 : 0;
  if (torn && running_ <= kMostRunning) return true;
  std::copy(displacement_px.begin(), displacement_px.end(), reference_.begin());
  std::copy(variance_px2.begin(), variance_px2.end(), referenceVariance_.begin());
  std::copy(valid.begin(), valid.end(), referenceValid_.begin());
  known_ = true;
  running_ = 0;
  return false;
}

void TearFinder::markSteps(const Lattice& lattice, std::span<const float> variance_px2,
                           std::span<const std::uint8_t> valid) {
  const auto layer = static_cast<int>(&lattice - lattices_.data());
  std::fill_n(steps_.begin() + layer * rows_, rows_, Step::kNone);
  const int row = lattice.columns;
  for (int gap = kReach - 1; gap + kReach < lattice.rows; ++gap) {
    float fifths = 0.0F, plain = 0.0F, noise = 0.0F;
    int columns = 0;
    for (int column = 0; column < lattice.columns; ++column) {
      const int node = lattice.at(column, gap);
      bool whole = true;
      for (int k = 1 - kReach; k <= kReach; ++k)
        whole = whole && valid[node + k * row] && referenceValid_[node + k * row];
      if (!whole) continue;
      const auto from = [&](int a, int b) { return increment_[node + b * row] - increment_[node + a * row]; };
      const Vector step = from(0, 1);
      fifths += ((1.0F / 6.0F) * (10.0F * step - 5.0F * from(-1, 2) + from(-2, 3))).squared();
      plain += from(-1, 0).squared() + step.squared() + from(1, 2).squared();
      // The middle two of the six rows contribute most.
      noise += kNoiseGain * (variance_px2[node] + variance_px2[node + row] + referenceVariance_[node] +
                             referenceVariance_[node + row]);
      ++columns;
    }
    const auto count = static_cast<float>(columns);
    Step& seen = steps_[layer * rows_ + gap];
    if (columns < kLeastColumns) {
      seen = Step::kUnknown;
      continue;
    }
    if (fifths <= noise * (1.0F + kDeviations / std::sqrt(count)) || fifths <= kFaint * plain) continue;
    const bool isLarge = fifths > kLeast_px2 * count && fifths > kClear * plain;
    seen = !isLarge ? Step::kFaint : fifths > kPlain * plain ? Step::kPlain : Step::kClear;
  }
}

/// Returns whether there is a step: clear in one layer and at least faint at the same height in all others; or plain,
/// if nothing is known of the others.
bool TearFinder::anyStep() const {
  const auto layers = static_cast<int>(lattices_.size());
  for (int layer = 0; layer < layers; ++layer) {
    for (int gap = 1; gap + 1 < rows_; ++gap) {
      const Step own = steps_[layer * rows_ + gap];
      if (own < Step::kClear) continue;
      bool agreed = true;
      for (int other = 0; other < layers; ++other) {
        const auto around = steps_.begin() + other * rows_ + gap;
        const Step most = std::max({around[-1], around[0], around[1]});
        agreed = agreed && (most >= Step::kFaint || (most == Step::kUnknown && own == Step::kPlain));
      }
      if (agreed && (layers > 1 || own == Step::kPlain)) return true;
    }
  }
  return false;
}

bool TearFinder::losesRows(const Lattice& lattice, std::span<const std::uint8_t> valid) const {
  int before = 0, now = 0;
  for (int i = lattice.first; i < lattice.first + lattice.count(); ++i) {
    before += referenceValid_[i];
    now += valid[i] && referenceValid_[i] ? 1 : 0;
  }
  int beforeAbove = 0, nowAbove = 0;
  for (int row = 0; row + kReach < lattice.rows; ++row) {
    for (int column = 0; column < lattice.columns; ++column) {
      const int i = lattice.at(column, row);
      beforeAbove += referenceValid_[i];
      nowAbove += valid[i] && referenceValid_[i] ? 1 : 0;
    }
    if (row + 1 < kReach) continue;
    const int beforeBelow = before - beforeAbove, nowBelow = now - nowAbove;
    const auto share = [](int part, int whole) {
      return static_cast<float>(part) / static_cast<float>(std::max(whole, 1));
    };
    const int least = kReach * lattice.columns / 2;
    if (beforeAbove < least || beforeBelow < least) continue;
    const float seenAbove = share(nowAbove, beforeAbove), seenBelow = share(nowBelow, beforeBelow);
    if (std::max(seenAbove, seenBelow) > kSeen && std::min(seenAbove, seenBelow) < kLost) return true;
  }
  return false;
}

}  // namespace tractiond::track
