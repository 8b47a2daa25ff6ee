// Approximates continuous tractions on the touched surface by point forces.
#pragma once

#include "sensor/gel.h"

namespace sensor::elastic {

/// Point forces whose sum is exactly the force of the patch.
struct PatchQuadrature {
  Points points;            ///< 3 x N, gel frame, z = 0 [m]
  Eigen::Matrix3Xd forces;  ///< 3 x N [N]
};

/// Returns a disc with traction along `force` proportional to sqrt(1 - r^2 / radius^2), as under a pressed ball (Hertz
/// 1882).
/// \param centre x, y, gel frame [m]; the disc may reach beyond the gel
/// \param radius above 0 [m]
/// \param force total force [N]; pressing: +z
/// \param rings number of rings of points; 0: as many as give the field at 6 mm depth to 1e-5 of its peak The same
/// parameters apply to the functions below. All are reentrant.
PatchQuadrature hertz(const Eigen::Vector2d& centre, double radius, const Eigen::Vector3d& force, int rings = 0);

/// Returns a disc with constant traction along `force`.
PatchQuadrature disc(const Eigen::Vector2d& centre, double radius, const Eigen::Vector3d& force, int rings = 0);

/// Returns a disc with tangential traction around its centre, proportional to r sqrt(1 - r^2 / radius^2). The resultant
/// force is zero.
/// \param torque [N m]; positive turns x towards y (about +z, into the gel)
PatchQuadrature twist(const Eigen::Vector2d& centre, double radius, double torque, int rings = 0);

}  // namespace sensor::elastic
