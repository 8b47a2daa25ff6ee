// Lays out the unknowns that free some round patches, linearly about a fit: their loads, one patch after the other,
// then their places.
#pragma once

#include "daemon/solve/round_patches.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <span>

namespace tractiond::solve {

/// Unknowns of a patch, and their number for the most patches.
inline constexpr int kPerPatch = kPatchLoads + kPatchPlaces;
inline constexpr int kMostFreed = kPerPatch * RoundPatches::kMost;

/// Change of a patch: force, torsion, x, y, spread [N, N m, m, m, m^2].
using PatchChange = Eigen::Matrix<double, kPerPatch, 1>;

/// The fit of some round patches, and the prior of their changes.
class FreedPatches {
 public:
  /// Prior deviation of the spread that the fit found [pitches^2].
  static constexpr double kFreeSpread = 0.25;

  FreedPatches() = default;
  /// \param patches at most RoundPatches::kMost (asserted)
  FreedPatches(std::span<const RoundPatch> patches, double pitch_m)
      : count_(static_cast<int>(patches.size()))
      , pitch_m_(pitch_m) {
    assert(count_ <= RoundPatches::kMost);
    std::copy(patches.begin(), patches.end(), patches_.begin());
  }

  int count() const { return count_; }  ///< Returns the number of patches.
  /// Returns the patches as fitted.
  std::span<const RoundPatch> patches() const { return {patches_.data(), static_cast<std::size_t>(count_)}; }
  const RoundPatch& patch(int k) const { return patches_[k]; }  ///< Returns patch `k` as fitted.

  /// Returns the index, among the unknowns of all patches, of the one that changes element `i` of patch `k`.
  /// \param i index in PatchChange: below kPatchLoads a load, else a place
  int index(int k, int i) const {
    return i < kPatchLoads ? kPatchLoads * k + i : kPatchLoads * count_ + kPatchPlaces * k + i - kPatchLoads;
  }

  /// Returns the prior deviation of this change [N, N m, m, m^2], which is also the unit of the unknown.
  /// \param i as in index()
  double unit(int k, int i) const {
    const double force_N = RoundPatches::kFreeLoad * patch(k).load.head<3>().norm();
    if (i < kPatchLoads) return i < 3 ? force_N : pitch_m_ * force_N;
    return i < kPatchLoads + 2 ? RoundPatches::kFreePlace * pitch_m_ : kFreeSpread * square(pitch_m_);
  }

  /// Returns the change of patch `k`.
  /// \param unknowns values of all unknowns [prior deviations]
  PatchChange change(int k, std::span<const double> unknowns) const {
    return PatchChange::NullaryExpr([&](Eigen::Index i) {
      const int number = static_cast<int>(i);
      return unit(k, number) * unknowns[index(k, number)];
    });
  }

  /// Returns patch `k` after a change.
  RoundPatch changed(int k, const PatchChange& by) const {
    const auto& [place, load] = patch(k);
    return {{place.x_m + by[4], place.y_m + by[5], place.spread_m2 + by[6]}, load + by.head<kPatchLoads>()};
  }

 private:
  std::array<RoundPatch, RoundPatches::kMost> patches_;
  int count_ = 0;
  double pitch_m_ = 0.0;
};

}  // namespace tractiond::solve
