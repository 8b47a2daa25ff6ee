// The strongest modes, as each frame reads them: side by side. In the factors they are a ninth of each row, and to
// reach the next row takes as long as to read them.
#pragma once

#include "daemon/solve/factors.h"

#include <vector>

namespace tractiond::solve {

/// The modes of the first group (ModelConstants::kGroups): what they show of a picture, and of each atom. Immutable
/// once made; any thread may read it.
struct StrongModes {
  /// The arguments need not outlive it.
  /// \param noise_px n, as calibrated
  StrongModes(const Factors& factors, const Atoms& atoms, double noise_px);

  int count;                 ///< of the modes
  RowMatrix left;            ///< the first columns of Factors::left, 2M x (4 + count), with what fills their last line
  RowMatrix right;           ///< the first columns of Factors::right, 3P x count
  RowMatrix rows;            ///< (S V_a)', 3A x count [px/N]
  std::vector<Block> alone;  ///< A: (S V_a)' S V_a
};

/// Returns how many singular values are above `least` [n / (E pitch^2)].
int modesAbove(double least, const Factors& factors, double noise_px);

}  // namespace tractiond::solve
