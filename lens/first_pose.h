// Where the camera is, without knowing where it might be.
#pragma once

#include "daemon/calibrate/aspect_check.h"
#include "daemon/calibrate/geometry_fit.h"
#include "lens/rest_markers.h"

#include <optional>
#include <vector>

namespace lens {

/// By solvePnP, with the lens as the sensor has it; its pose does not count. Gel and window are crossed as if they were
/// air of their thickness over their index, which is right near the axis. Nothing: four markers are needed, and places
/// that some camera can see. Reentrant.
std::optional<sensor::Camera> solvePose(const sensor::Sensor& sensor, const RestMarkers& markers);

struct FirstPoseOptions {
  double clear_px = 0.1;  ///< residual: where the file's lens leaves no more, no other start is tried
  /// Distortion at the picture's corners, relative, that the starts assume besides the file's.
  std::vector<double> distortions = {-0.06, -0.12, -0.18, -0.25, 0.06};
  double tilt = 0.2;  ///< by which each start is tilted to four sides as well [rad]
};

/// The same, refined with refraction, and with lens and pattern as uncertain as the gel file has them. Few dots in one
/// plane that do not lie exactly as described have several minima, which distortion, tilt and principal point share
/// among themselves. So the fit is made from several starts, always the same ones, and that with the least residual is
/// returned; markers that do not count in it count as far off. All starts take 0.1 to 0.5 s for 70 to 80 dots.
tractiond::calibrate::Geometry firstPose(const sensor::Sensor& sensor, const RestMarkers& markers,
                                         const FirstPoseOptions& options = {});

/// Another aspect than the sensor's that explains the places where no pose and lens with the sensor's does.
std::optional<tractiond::calibrate::AspectSeen> otherAspect(const sensor::Sensor& sensor, const RestMarkers& markers);

}  // namespace lens
