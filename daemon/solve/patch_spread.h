// Divides the force of a round patch among the points beneath it.
#pragma once

#include "daemon/solve/patch_influence.h"

#include <array>
#include <span>
#include <vector>

namespace tractiond::solve {

/// Thread-bound. Allocates only when made.
class PatchSpread {
 public:
  /// `atoms` must outlive it; their points must be a grid.
  explicit PatchSpread(const Atoms& atoms);

  /// Computes the shares of the points (P) in the force of a patch; their sum is 1. \param centred true: the centroid
  /// of the shares is the place of the patch. A place beyond the grid of points counts as the nearest one on its border
  void divide(const PatchPlace& place, bool centred, std::span<double> share);

  /// Returns what the wrench of a patch at the place of the last divide() has more than its forces at the points, a
  /// couple [N m]: its torsion, and the moment by what their centroid is off.
  Eigen::Vector3d couple(const PatchLoad& load) const;

 private:
  const Atoms& atoms_;
  std::array<std::vector<double>, 2> along_;       // of the columns and rows of points
  Eigen::Vector3d off_ = Eigen::Vector3d::Zero();  // of the last place from the centroid of its shares [m]
};

}  // namespace tractiond::solve
