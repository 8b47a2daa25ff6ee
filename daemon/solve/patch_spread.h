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

  /// Computes and returns the shares of the points (P) in the force of a patch; their sum is 1.
  /// \param centred true: the centroid of the shares is the place of the patch. A place beyond the grid of points
  /// counts as the nearest one on its border
  std::span<const double> divide(const PatchPlace& place, bool centred);

  /// Adds the forces of a patch, at the place of the last divide(), to those of the points, and sets its couple: what
  /// its wrench has more than these forces, the moment by what the centroid of the shares is off. Torsion is forces
  /// around that centroid, which grow with the distance from it; their sum is 0.
  /// \param number of the couple
  /// \param forces of points and couples (3 (P + kCouples))
  void add(const PatchLoad& load, int number, std::span<double> forces) const;

 private:
  const Atoms& atoms_;
  std::array<std::vector<double>, 2> along_;  // of the columns and rows of points
  std::vector<double> share_;                 // P
  // Of the last place: its way from the centroid of the shares, this centroid, and the mean squared distance of the
  // shares from it.
  Eigen::Vector3d off_ = Eigen::Vector3d::Zero();
  Eigen::Vector2d centroid_m_ = Eigen::Vector2d::Zero();
  double spread_m2_ = 1.0;
};

}  // namespace tractiond::solve
