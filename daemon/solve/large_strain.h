// Tells where forces strain the gel more than linear elasticity describes within the stated uncertainty
// (docs/mathematics.md, 4.7).
#pragma once

#include "daemon/solve/kernels.h"
#include "sensor/sensor.h"

#include <span>
#include <vector>

namespace tractiond::solve {

/// Computes how far forces on a half-space compress it below each node, at the depth of the nearest markers
/// (Boussinesq): the error of large strain grows with that for probes of all sizes, and it hardly depends on how narrow
/// a contact is, which the picture does not show well. Thread-bound. Allocates only when made.
class LargeStrain {
 public:
  /// \param nodes 3 x N [m], need not outlive it
  LargeStrain(const sensor::Points& nodes, double depth_m, double youngsModulus_Pa);

  /// Returns whether such forces, each taken as pressing, compress the gel by more than a quarter below a node.
  /// \param force_N 3N
  bool outOfRange(std::span<const double> force_N);

 private:
  RowMatrix strain_;            ///< N x N [1/N]: pressure below a node over Young's modulus, by a force on another
  LineArray<double> below_;     ///< N, padded: of the last forces
  std::vector<int> loaded_;     ///< nodes that carry a force
  std::vector<float> force_N_;  ///< of each of them
};

}  // namespace tractiond::solve
