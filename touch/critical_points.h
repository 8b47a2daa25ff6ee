// Finds where the shear on the gel vanishes, and around which it turns: vortices, sources, sinks and saddles.
//
// Between the nodes the shear is linear in triangles: squares of four nodes are cut along the diagonal whose nodes have
// an even column + row (as VTK does, which finds the same points). A point lies where the shear winds once around a
// triangle (its index, Poincare 1881): +1, or -1 of a saddle. How strong it is (its robustness: Wang, Rosen, Skraba,
// Bhatia, Pascucci 2013) is the least change of the nodes' shear, in their deviations, that lets it vanish: shear that
// reaches it from outside of what is touched, or another point of the other index. What noise makes vanishes at once.
#pragma once

#include <array>
#include <cstdint>
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

enum class CriticalKind : std::uint8_t {
  kVortex,  ///< the shear turns about it more than it points towards or away from it: all spirals that do
  kSource,  ///< points away from it
  kSink,    ///< points towards it
  kSaddle,
};

struct CriticalPoint {
  CriticalKind kind = CriticalKind::kVortex;
  int index = 1;  ///< -1: a saddle
  /// Where shear over pressure vanishes, which changes more evenly than the shear: fitted to the nodes around.
  std::array<double, 2> position_m{};
  /// That noise of the nodes around causes if it is the same in all of them; places are off by a third more (rms).
  std::array<double, 2> positionDeviation_m{};
  std::array<double, 2> betweenNodes_m{};  ///< where the shear vanishes that is linear between the nodes
  double strength = 0.0;                   ///< robustness [deviations of a node's shear]
  /// Direction of the shear beside that away from the point, from x towards y: 0 of a source, +-pi/2 of a vortex, pi of
  /// a sink. Of a saddle 0.
  double angle_rad = 0.0;
};

/// Strength from which on a point is listed.
inline constexpr double kLeastStrength = 3.0;

/// Returns the critical points, strongest first. None where numbers are missing or not finite. Reentrant.
std::vector<CriticalPoint> criticalPoints(const NodeForces& nodes, double leastStrength = kLeastStrength);

}  // namespace touch
