// The closed forms of Boussinesq and Cerruti for a point force on an elastic half-space.
#pragma once

#include <Eigen/Core>

#include <array>

namespace sensor::elastic {

/// Displacement [m/N]: column j is the displacement for a unit force along axis j at the origin of the free surface
/// z = 0, seen at `offset` = point - force position [m] (z >= 0, not all zero). youngsModulus in Pa. Reentrant.
/// Source: Love, Mathematical Theory of Elasticity, arts. 135 and 166; docs/mathematics.md 1.1.
Eigen::Matrix3d halfSpaceDisplacement(const Eigen::Vector3d& offset, double youngsModulus, double poissonRatio);

/// Stress [Pa/N] of the same field: element j is the symmetric stress tensor for a unit force along axis j. It does not
/// depend on Young's modulus. Tension is positive. Reentrant.
std::array<Eigen::Matrix3d, 3> halfSpaceStress(const Eigen::Vector3d& offset, double poissonRatio);

}  // namespace sensor::elastic
