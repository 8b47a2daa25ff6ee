// Continuous pressures on the touched surface, as weighted points for the point-force fields.
#pragma once

#include "sensor/gel.h"

namespace sensor::elastic {

/// Forces at points; their sum is the patch's force, exactly.
struct PatchQuadrature {
  Points points;            ///< 3 x N, z = 0 [m]
  Eigen::Matrix3Xd forces;  ///< 3 x N [N]
};

/// Each patch is a disc of `radius` [m] around `centre` [m], its traction everywhere along `force` [N] (pressing: +z).
/// `rings` 0 takes as many as make the field of a patch of this radius good to 1e-5 of its peak at 6 mm depth.
/// Traction proportional to sqrt(1 - r^2 / radius^2), as under a pressed ball (Hertz, 1882).
PatchQuadrature hertz(const Eigen::Vector2d& centre, double radius, const Eigen::Vector3d& force, int rings = 0);

/// Constant traction.
PatchQuadrature disc(const Eigen::Vector2d& centre, double radius, const Eigen::Vector3d& force, int rings = 0);

/// Tangential traction proportional to r sqrt(1 - r^2 / radius^2) around the centre. Positive torque [N m] turns x
/// towards y (about +z, into the gel). The resultant force is zero.
PatchQuadrature twist(const Eigen::Vector2d& centre, double radius, double torque, int rings = 0);

}  // namespace sensor::elastic
