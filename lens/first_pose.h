// Estimates the camera's pose without a start value.
#pragma once

#include "daemon/calibrate/aspect_check.h"
#include "daemon/calibrate/geometry_fit.h"
#include "lens/rest_markers.h"

#include <optional>

namespace lens {

/// Solves for the pose by OpenCV's solvePnP, with the sensor's lens. Gel and window are replaced by air of their
/// thickness divided by their index, which is exact near the axis. Returns the sensor's camera with the new pose;
/// nothing if fewer than four markers are present, or no camera in front of the window fits. The sensor's own pose is
/// not used. Reentrant.
std::optional<sensor::Camera> solvePose(const sensor::Sensor& sensor, const RestMarkers& markers);

/// Refines the pose of solvePose() with refraction, and with lens and pattern free within the gel file's uncertainties.
/// A few dots in one plane that do not lie exactly as described have several minima, because distortion, tilt and
/// principal point can compensate each other. The fit is therefore made from several fixed starts. Returns the fit with
/// the smallest residual, in which outliers count at their limit. All starts take 0.1 to 0.5 s for 70 to 80 dots.
/// Outcome kDiverged: no fit converged, no start was found, or fewer than GeometryOptions::fewest markers are present;
/// the rest has no meaning then. Never kFewMarkers. Reentrant.
tractiond::calibrate::Geometry firstPose(const sensor::Sensor& sensor, const RestMarkers& markers);

/// Returns the markers with their columns and rows counted from where a pose fits them best, at most four further to
/// each side. Where a picture does not show the grid's rims, the pose that the sensor has decides on the labels, and a
/// pose that is off by a pitch makes all of them wrong. A body's markers are not at equal distances in the picture, so
/// their places show it; a block's do not, and are returned as they are. Takes about a second. Reentrant.
RestMarkers counted(const sensor::Sensor& sensor, RestMarkers markers);

/// Returns another aspect than the sensor's if it explains the markers' positions and the sensor's does not; nothing if
/// the sensor's does, no aspect does, or no pose is found. Does not use the sensor's pose. Reentrant.
std::optional<tractiond::calibrate::AspectSeen> otherAspect(const sensor::Sensor& sensor, const RestMarkers& markers);

}  // namespace lens
