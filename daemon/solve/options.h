// Options of the solvers; fixed for the life of a solver.
#pragma once

#include "sensor/elastic/influence.h"

#include <cstdint>

namespace tractiond::solve {

enum class Solving : std::uint8_t {
  kContactStep,  ///< solves for the nodes that carry a load; for all nodes if the contact is too large for that
  kModel,        ///< solves by one statistical model of all contacts; experimental and slower
};

struct SolveOptions {
  Solving solving = Solving::kContactStep;

  /// The real block, or the paper's half-space (which misses the total force of a thick block by up to 60 %).
  sensor::elastic::Model model = sensor::elastic::Model::kBlock;

  /// lambda of Tikhonov's penalty as a fraction of the influence matrix's largest singular value. At 1e-3 the total
  /// force is right within 1 % without noise; 3e-3 loses up to 6 % of it, 1e-2 up to 17 %; 3e-4 nearly doubles the
  /// shear noise.
  double regularisation = 1e-3;

  /// Singular values below this fraction of lambda are left out. At 0.5 that changes no resultant tried by more than
  /// 0.2 % of the load and leaves 10 of 28 MB for the fit of the whole face to stream; at 1 it changes them by up to
  /// 0.5 %.
  double truncation = 0.5;

  /// Standard deviation of a marker's centre in one frame [px], as calibrated; the frame's own scales the uncertainty.
  double noise_px = 0.018;

  /// false: never uses the contact step, but solves for all nodes.
  bool contactAware = true;

  /// Typical force of a node in the two maps of the search for contacts [N]: a small one finds weak touches, a large
  /// one finds edges. With these values a press of 5 gf is twice as strong as needed, and a contact covers 20 to 60
  /// nodes.
  double touchForce_N = 1e-3;
  double shapeForce_N = 9e-3;

  /// Least expected force of a node in the contact step [N]; stronger contacts increase it.
  double forceScale_N = 10e-3;

  /// Share of the markers that may be missing; beyond, the field is not valid. Isolated gaps of the zero are not among
  /// these markers (MarkerField::isolatedGaps). If a quarter goes missing at once, that frame takes some 3 ms longer.
  double maxMissingFraction = 0.25;
  /// Returns the least number of markers that gives a field. \param markers M, all of the sensor \param isolatedGaps as
  /// MarkerField::isolatedGaps
  int fewestMarkers(int markers, int isolatedGaps) const {
    const int expected = markers - isolatedGaps;
    return expected - static_cast<int>(maxMissingFraction * expected);
  }

  /// Normal force above which there is a centre of pressure [N], if it is not in the noise.
  double minPressForCentre_N = 0.03;
};

}  // namespace tractiond::solve
