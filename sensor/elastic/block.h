// Displacements inside a finite block under point forces on its top: base bonded, sides and top free.
//
// u = half-space field (closed form) + w. The smooth correction w carries minus the half-space's tractions on the four
// sides, minus its displacement on the base, and nothing on the top (docs/mathematics.md 1.3).
#pragma once

#include "sensor/gel.h"

#include <array>
#include <functional>
#include <memory>
#include <vector>

namespace sensor::elastic {

struct BlockOptions {
  int degree = 8;            ///< of the elements' polynomials
  double clearance = 15e-3;  ///< smallest distance of a force from a side [m]; below 8 mm the mesh is graded
  /// Element boundaries of the quarter block along x, y and the depth, from 0 to 1, as fractions of half the width,
  /// half the height and the thickness. Empty: chosen from the gel's proportions and the clearance.
  std::array<std::vector<double>, 3> breaks;
};

/// Called with the fraction done in [0, 1]; may be empty.
using Progress = std::function<void(double)>;

/// The correction w of one gel at fixed targets, ready for any forces. The constructor does the work, with the BLAS's
/// threads; immutable afterwards, reentrant.
class BlockCorrection {
 public:
  /// targets: 3 x T, in the block.
  BlockCorrection(const Gel& gel, const Points& targets, const BlockOptions& options = {},
                  const Progress& progress = {});
  ~BlockCorrection();
  BlockCorrection(BlockCorrection&&) noexcept;
  BlockCorrection& operator=(BlockCorrection&&) noexcept;

  /// 3T x 3S [m/N]: rows 3t.. are w at target t, columns 3s.. the unit forces along x, y, z at source s (z = 0).
  Eigen::MatrixXd matrix(const Points& sources) const;

  /// 3 x T [m]: w under forces[N] at the sources, both 3 x S, all together.
  Points displacement(const Points& sources, const Eigen::Matrix3Xd& forces) const;

 private:
  struct Data;
  std::unique_ptr<const Data> data_;
};

/// Half-space field plus correction, 3T x 3S [m/N] as in BlockCorrection::matrix. Targets lie off the sources;
/// options.clearance is lowered to that of the sources.
Eigen::MatrixXd blockDisplacement(const Gel& gel, const Points& targets, const Points& sources,
                                  const BlockOptions& options = {}, const Progress& progress = {});

}  // namespace sensor::elastic
