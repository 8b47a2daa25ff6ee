// What a patch does otherwise than the shares of nodes that stand for it.
//
// Nodes are two pitches above the nearest markers: interpolated between them, a patch is right to 1 % there. Among the
// markers that is little, but where they see a contact from one side only, a fit makes ten times as much of it.
#pragma once

#include "daemon/solve/patch_fit.h"
#include "sensor/sensor.h"

#include <vector>

namespace tractiond::solve {

/// Of a block with a flat face: a half-space has the same difference, whose field ends within a few pitches.
/// Thread-bound. Allocates only when made.
class OffGrid {
 public:
  OffGrid(const sensor::Sensor& sensor, int stride);

  /// `picture` without that difference, times `share`; it lasts until the next call.
  Picture without(const Patch& patch, const Picture& picture, double share = 1.0);

 private:
  const sensor::NodeGrid grid_;
  const sensor::Points nodes_, markers_;
  const double youngsModulus_, poissonRatio_;
  std::vector<Eigen::Matrix<double, 2, 3>> jacobian_;  ///< of the projection, at each marker [px/m]
  std::vector<double> displacement_;
};

}  // namespace tractiond::solve
