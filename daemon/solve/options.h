// What can be chosen about solving; fixed for the life of a solver.
#pragma once

#include "sensor/elastic/influence.h"

namespace tractiond::solve {

struct SolveOptions {
  /// The real block, or the paper's half-space (which misses the total force of a thick block by up to 60 %).
  sensor::elastic::Model model = sensor::elastic::Model::kBlock;

  /// lambda of Tikhonov's penalty as a fraction of the influence matrix's largest singular value. At 1e-3 the total
  /// force is right within 1 % without noise; 1e-2 loses 12 to 17 % of it, 1e-4 doubles the noise.
  double regularisation = 1e-3;

  /// Singular values below this fraction of lambda are left out. They carry less than 0.2 % of any resultant tried, and
  /// at 0.5 more than half of all bytes that a frame would stream.
  double truncation = 0.5;

  /// Share of the markers that may be missing; beyond, the field is not valid. Taking a quarter of them out at once
  /// costs a frame some milliseconds, once.
  double maxMissingFraction = 0.25;

  /// Normal force above which there is a centre of pressure [N]: five standard deviations of the normal force at 0.02
  /// px of tracking noise.
  double minPressForCentre_N = 0.25;
};

}  // namespace tractiond::solve
