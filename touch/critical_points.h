// Finds where the shear on the gel vanishes, and around which it turns: vortices, sources, sinks and saddles.
//
// Between the nodes the shear is linear in triangles: squares of four nodes are cut along the diagonal whose nodes have
// an even column + row (as VTK does, which finds the same points). A point lies where the shear winds once around a
// triangle (its index, Poincare 1881): +1, or -1 of a saddle. How strong it is (its robustness: Wang, Rosen, Skraba,
// Bhatia, Pascucci 2013) is the least change of the nodes' shear, in their deviations, that lets it vanish: shear that
// reaches it from outside of what is touched, or another point of the other index. What noise makes vanishes at once.
#pragma once

#include "traction/messages.h"

#include <array>
#include <span>
#include <vector>

namespace touch {

/// What the nodes of a flat grid bear. Index: row * columns + column, columns along x, rows along y. Gel frame.
struct NodeForces {
  int columns = 0, rows = 0;
  double pitch_m = 0.0;
  std::array<double, 2> centre_m{};  ///< of the grid
  std::span<const std::array<float, 3>> force_N;
  std::span<const std::array<float, 3>> deviation_N;  ///< of force_N; 0: nothing touches
};

using traction::CriticalPointKind;

/// The position is where shear over pressure vanishes, which changes more evenly than the shear: fitted to the nodes
/// around.
struct CriticalPoint : traction::CriticalPoint {
  std::array<double, 2> betweenNodes_m{};  ///< where the shear vanishes that is linear between the nodes
};

/// Strength from which on a point is listed.
inline constexpr double kLeastStrength = 3.0;

/// Returns the critical points, strongest first. None where numbers are missing. Reentrant.
std::vector<CriticalPoint> criticalPoints(const NodeForces& nodes, double leastStrength = kLeastStrength);

}  // namespace touch
