// Divides the force of a round patch among the points beneath it.
#pragma once

#include "daemon/solve/patch_influence.h"

#include <Eigen/Geometry>

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

  /// Returns the force of a patch at a point, at the place of the last divide(), which made `share`. Torsion is forces
  /// around the centroid of the shares, which grow with the distance from it; their sum is 0.
  Eigen::Vector3d force(const PatchLoad& load, std::span<const double> share, std::size_t point) const;
  /// Returns what the wrench of the patch has more than these forces, a couple [N m]: the moment by what their centroid
  /// is off.
  Eigen::Vector3d couple(const PatchLoad& load) const { return off_.cross(load.head<3>()); }

 private:
  const Atoms& atoms_;
  std::array<std::vector<double>, 2> along_;  // of the columns and rows of points
  // Of the last place: its way from the centroid of the shares, this centroid, and the mean squared distance of the
  // shares from it.
  Eigen::Vector3d off_ = Eigen::Vector3d::Zero();
  Eigen::Vector2d centroid_m_ = Eigen::Vector2d::Zero();
  double spread_m2_ = 1.0;
};

}  // namespace tractiond::solve
