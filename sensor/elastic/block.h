// Displacements inside a finite bonded block under point forces on its top.
//
// u = half-space field (closed form) + w. The smooth correction w carries minus the half-space's tractions on the four
// sides, minus its displacement on the bonded base, and nothing on the top; it is found with spectral elements on a
// quarter of the block, once for each of the four parity classes of the two mirror symmetries.
#pragma once

#include "sensor/gel.h"

#include <functional>

namespace sensor::elastic {

struct BlockOptions {
  int degree = 8;                       ///< of the elements' polynomials
  // Element boundaries of the quarter block as fractions of half the width, half the height and the thickness;
  // empty: chosen from the positions of the forces (graded when some lie within 8 mm of a side).
  std::vector<double> breaksX, breaksY, breaksZ;
};

/// Called with a fraction done in [0, 1]; may be empty.
using Progress = std::function<void(double)>;

/// The correction w alone [m/N]: 3 T x 3 S; rows 3t..3t+2 are the displacement at target t, columns 3s..3s+2 the unit
/// forces along x, y, z at source s (z = 0). Targets lie in the block, off its top's sources. Uses the BLAS's threads.
Eigen::MatrixXd blockCorrection(const Gel& gel, const Points& targets, const Points& sources,
                                const BlockOptions& options = {}, const Progress& progress = {});

/// Half-space field plus correction, same shape.
Eigen::MatrixXd blockDisplacement(const Gel& gel, const Points& targets, const Points& sources,
                                  const BlockOptions& options = {}, const Progress& progress = {});

}  // namespace sensor::elastic
