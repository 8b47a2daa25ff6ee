// What a patch does otherwise than the shares of nodes that stand for it.
//
// Nodes are two pitches above the nearest markers: interpolated between them, a patch is right to 1 % there. Among the
// markers that is little, but where they see a contact from one side only, a fit makes ten times as much of it.
#pragma once

#include "daemon/solve/patch.h"
#include "sensor/sensor.h"

#include <span>
#include <vector>

namespace tractiond::solve {

/// Of a block with a flat face: a half-space has the same difference, whose field ends within a few pitches.
/// Thread-bound. Allocates only when made.
class OffGrid {
 public:
  explicit OffGrid(const sensor::Sensor& sensor);

  /// Where a patch and its stencil differ.
  struct Difference {
    std::vector<int> coordinates;  ///< of markers near the patch that are not missing
    /// Of each coordinate, for each component of the force, what 1 N of the patch does more [px/N], and its derivatives
    /// by column, row and spread: kinds[12 coordinate + 4 component + kind].
    std::vector<double> kinds;
  };

  /// It lasts until the next call.
  const Difference& of(const Patch& patch, std::span<const int> missing);

 private:
  const sensor::NodeGrid grid_;
  const sensor::Points nodes_, markers_;
  const double youngsModulus_, poissonRatio_;
  std::vector<Eigen::Matrix<double, 2, 3>> jacobian_;  ///< of the projection, at each marker [px/m]
  Difference difference_;
};

}  // namespace tractiond::solve
