// Computes the difference between the displacements by a round patch and by the forces on nodes that represent it.
//
// Nodes are two pitches above the nearest markers. A patch that is interpolated between them has an error of 1 % there.
// That is small for a contact amid the markers, but the error of a fit is ten times as large at the rim, where markers
// lie on one side of the contact only.
#pragma once

#include "daemon/solve/patch.h"
#include "sensor/sensor.h"

#include <span>
#include <vector>

namespace tractiond::solve {

/// Computes the difference by the equations of a half-space; that of a block is the same, as it vanishes within a few
/// pitches. Thread-bound. Allocates only when made.
class OffGrid {
 public:
  /// \param sensor a block with at least 4 x 4 nodes; need not outlive the object
  explicit OffGrid(const sensor::Sensor& sensor);

  struct Difference {
    std::vector<int> coordinates;  ///< of markers near the patch that are not missing
    /// For each of `coordinates` and each component of the force: displacement by the patch less that by its Stencil
    /// [px/N] (kind 0), and its derivatives by column, row and spread (1 to 3): kinds[12 coordinate + 4 component +
    /// kind].
    std::vector<double> kinds;
  };

  /// Returns the difference for a patch; its force is not used. Valid until the next call. \param missing coordinates,
  /// both of each missing marker
  const Difference& of(const Patch& patch, std::span<const int> missing);

 private:
  const sensor::NodeGrid grid_;
  const sensor::Points nodes_, markers_;
  const double youngsModulus_, poissonRatio_;
  std::vector<Eigen::Matrix<double, 2, 3>> jacobian_;  ///< of the projection, at each marker [px/m]
  Difference difference_;
};

}  // namespace tractiond::solve
