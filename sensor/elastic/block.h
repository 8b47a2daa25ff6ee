// Computes displacements inside a finite block under point forces on its touched surface: base bonded, sides and
// touched surface free.
//
// u = half-space field (closed form) + w. The smooth correction w carries minus the half-space's tractions on the four
// sides, minus its displacement on the base, and no traction on the touched surface (docs/mathematics.md 1.3).
#pragma once

#include "sensor/gel.h"

#include <functional>
#include <memory>

namespace sensor::elastic {

/// Degree of the elements' polynomials, unless less precision is enough.
inline constexpr int kBlockDegree = 8;

struct BlockOptions {
  int degree = kBlockDegree;  ///< at least 2
  double clearance = 15e-3;   ///< smallest distance of a force from a side [m]; below 8 mm the mesh is graded
  /// The work is done for each call's sources, not for the targets: less work for fewer sources than targets.
  bool solveForSources = false;
};

/// Returns the clearance of sources (3 x S, gel frame [m]), at most the default.
double clearanceOf(const Gel& gel, const Points& sources);

/// Called on the calling thread with the completed fraction, in (0, 1], ascending. May be empty. May throw,
/// which ends the computation.
using Progress = std::function<void(double)>;

/// The correction w of one gel at fixed targets, for any forces. The constructor does most of the work, on all the
/// machine's cores. Immutable afterwards and reentrant; copies share it.
class BlockCorrection {
 public:
  /// Takes seconds. The arguments need not outlive the object. Asserts that the degree is at least 2, and Poisson's
  /// ratio below 0.5.
  /// \param targets 3 x T, gel frame [m], in the block (not checked)
  BlockCorrection(const Gel& gel, const Points& targets, const BlockOptions& options = {},
                  const Progress& progress = {});

  /// Returns w per unit force, 3T x 3S [m/N]: rows 3t.. are w at target t, columns 3s.. the unit forces along x, y, z
  /// at source s.
  /// \param sources 3 x S, gel frame [m], z = 0, no nearer to a side than BlockOptions::clearance: the result is
  /// inexact there (not checked)
  Eigen::MatrixXd matrix(const Points& sources) const;

 private:
  struct Data;
  std::shared_ptr<const Data> data_;
};

/// Returns the half-space field plus the correction, 3T x 3S [m/N], laid out as BlockCorrection::matrix(). Sources may
/// be as near to a side as they like: uses clearanceOf(sources). No target may coincide with a source: the result is
/// not finite there. Takes seconds; less for few sources.
/// \param degree BlockOptions::degree
Eigen::MatrixXd blockDisplacement(const Gel& gel, const Points& targets, const Points& sources,
                                  int degree = kBlockDegree, const Progress& progress = {});

}  // namespace sensor::elastic
