// The direction in which a camera sees a point of the gel, through materials that refract. Gel frame, metres.
#pragma once

#include "sensor/gel.h"

#include <array>
#include <vector>

namespace sensor {

/// A surface between two transparent materials: a plane of constant z, or the half of an ellipsoid that is towards
/// lower z, its axes along x, y and z. The camera looks along -z, from the inside of an ellipsoid outwards.
struct RefractingSurface {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< [m]; of a plane only z counts
  Eigen::Vector3d radii = Eigen::Vector3d::Zero();   ///< semi-axes [m]; all 0: a plane
  double index = 1.0;                                ///< refractive index of the material towards the camera

  bool isPlane() const { return radii.isZero(0.0); }  ///< Returns whether it is a plane.
};

/// Returns whether a point [m] is on the camera's side of a surface.
bool isBehind(const RefractingSurface& surface, const Eigen::Vector3d& point);

/// The ray that leaves the camera towards a point.
struct SightLine {
  Eigen::Vector3d direction;  ///< z is -1; not a number if no ray reaches the point
  Eigen::Matrix3d byPoint;    ///< d(direction) / d(point) [1/m]
};

/// A layer between planes of constant z.
struct FlatLayer {
  double index = 1.0;
  double thickness = 0.0;  ///< [m]; negative: the camera is within, and the result has no meaning
};

/// Returns the ray from a camera at `eye` [m] to a point [m] below it.
/// \param layers from the point to the camera
SightLine flatSightLine(const Eigen::Vector3d& eye, const std::array<FlatLayer, 3>& layers,
                        const Eigen::Vector3d& point);

/// Returns the ray from a camera at `eye` [m], behind all surfaces, to a point [m] in the gel.
/// \param surfaces from the gel to the camera, not crossing each other
SightLine curvedSightLine(const Eigen::Vector3d& eye, const std::vector<RefractingSurface>& surfaces, double gelIndex,
                          const Eigen::Vector3d& point);

}  // namespace sensor
