// Where the camera is, without knowing where it might be.
#pragma once

#include "daemon/calibrate/aspect_check.h"
#include "daemon/calibrate/geometry_fit.h"
#include "lens/rest_markers.h"

#include <optional>

namespace lens {

/// By solvePnP, with the lens as the sensor has it; its pose does not count. Gel and window are crossed as if they were
/// air of their thickness over their index, which is right near the axis. Nothing: four markers are needed, and places
/// that some camera can see. Reentrant.
std::optional<sensor::Camera> solvePose(const sensor::Sensor& sensor, const RestMarkers& markers);

/// The same, refined with refraction, and with lens and pattern as uncertain as the gel file has them.
tractiond::calibrate::Geometry firstPose(const sensor::Sensor& sensor, const RestMarkers& markers);

/// Another aspect than the sensor's that explains the places where no pose and lens with the sensor's does.
std::optional<tractiond::calibrate::AspectSeen> otherAspect(const sensor::Sensor& sensor, const RestMarkers& markers);

}  // namespace lens
