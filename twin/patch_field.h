// Displacements of the half-space under a round patch, fast enough for every marker of every frame.
#pragma once

#include "twin/scenario.h"

#include <vector>

namespace twin {

/// Displacement per unit load: columns are 1 N along x, y, z [m/N] and 1 N m about z [m/(N m)].
using UnitResponse = Eigen::Matrix<double, 3, 4>;

/// The field of a patch of one shape and size at fixed depths. A patch is round, so its response rotates with the
/// direction to the point, and a table over the distance suffices. Immutable after construction and reentrant.
class PatchField {
 public:
  /// \param radius of the patch [m]
  /// \param depths z of the points to be evaluated [m]
  /// \param farthest largest distance of these points from the patch's axis [m]
  PatchField(const sensor::Gel& gel, Contact::Shape shape, double radius, const std::vector<double>& depths,
             double farthest);

  /// Returns the response at depths[depth], at `offset` (x, y) [m] from the patch's centre, to 1e-5 of the peak.
  /// Offsets longer than `farthest` are not checked.
  UnitResponse at(std::size_t depth, const Eigen::Vector2d& offset) const;

 private:
  std::vector<std::vector<UnitResponse>> tables_;  ///< per depth: responses on the x axis at multiples of a fixed step
};

}  // namespace twin
