// Displacements of the half-space under one round patch, fast enough for every marker of every frame.
#pragma once

#include "twin/scenario.h"

#include <vector>

namespace twin {

/// Displacement [m] per unit load: columns are 1 N along x, y, z and 1 N m about z.
using UnitResponse = Eigen::Matrix<double, 3, 4>;

/// The field of a patch of one shape and size at fixed depths. The patch is round, so its response turns with the
/// direction to the point, and a table over the distance is enough. Reentrant; immutable after construction.
class PatchField {
 public:
  /// depths [m]: z of the points that will be asked for; farthest [m]: their greatest distance from the patch's axis.
  PatchField(const sensor::Gel& gel, Contact::Shape shape, double radius, const std::vector<double>& depths,
             double farthest);

  /// At depths[depth], `offset` [m] from the patch's centre. Good to 1e-5 of the peak.
  UnitResponse at(std::size_t depth, const Eigen::Vector2d& offset) const;

 private:
  std::vector<std::vector<UnitResponse>> tables_;  ///< for each depth, on the x axis, at multiples of a fixed step
};

}  // namespace twin
