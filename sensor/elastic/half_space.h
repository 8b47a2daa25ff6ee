// Closed forms of Boussinesq and Cerruti for a point force on an elastic half-space.
#pragma once

#include <Eigen/Core>

#include <array>

namespace sensor::elastic {

/// Returns the displacement per unit force [m/N]: column j is the displacement under a unit force along axis j at the
/// origin of the free surface z = 0.
/// \param offset point - position of the force [m], z >= 0, not zero
/// \param youngsModulus [Pa] Reentrant. Source: Love, Mathematical Theory of Elasticity, arts. 135 and 166;
/// docs/mathematics.md 1.1.
Eigen::Matrix3d halfSpaceDisplacement(const Eigen::Vector3d& offset, double youngsModulus, double poissonRatio);

/// Returns the stress of the same field per unit force [Pa/N] at `offset` [m], as above: element j is the symmetric
/// stress tensor under a unit force along axis j. Tension is positive. The stress does not depend on Young's modulus.
/// Reentrant.
std::array<Eigen::Matrix3d, 3> halfSpaceStress(const Eigen::Vector3d& offset, double poissonRatio);

}  // namespace sensor::elastic
