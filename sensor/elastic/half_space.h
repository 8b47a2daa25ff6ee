// The closed forms of Boussinesq and Cerruti for a point force on an elastic half-space.
#pragma once

#include <Eigen/Core>

namespace sensor::elastic {

/// Displacement [m] per newton: column j is the displacement for a unit force along axis j at the origin of the free
/// surface z = 0, seen at `offset` = point - force position (z >= 0, not both zero).
/// youngsModulus in Pa. Reentrant.
Eigen::Matrix3d halfSpaceDisplacement(const Eigen::Vector3d& offset, double youngsModulus, double poissonRatio);

/// Stress [Pa] per newton of the same field: element j is the symmetric stress tensor for a unit force along axis j.
struct PointForceStress {
  Eigen::Matrix3d tensor[3];
};
PointForceStress halfSpaceStress(const Eigen::Vector3d& offset, double poissonRatio);

}  // namespace sensor::elastic
