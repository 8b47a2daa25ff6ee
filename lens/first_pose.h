// Estimates the camera's pose without a start value.
#pragma once

#include "daemon/calibrate/aspect_check.h"
#include "daemon/calibrate/geometry_fit.h"
#include "lens/rest_markers.h"

#include <optional>

namespace lens {

/// Solves for the pose by OpenCV's solvePnP, with the sensor's lens. As solvePnP knows no refraction, each marker is
/// replaced by the point where it appears through all refracting surfaces to a camera near the sensor's position.
/// Returns the sensor's camera with the new pose; nothing if fewer than four markers are present, or no camera behind
/// the window fits. The sensor's rotation is not used. Reentrant.
std::optional<sensor::Camera> solvePose(const sensor::Sensor& sensor, const RestMarkers& markers);

/// Refines the pose of solvePose() with refraction, and with lens and pattern free within the gel file's uncertainties.
/// A few dots in one plane that do not lie exactly as described have several minima, because distortion, tilt and
/// principal point can compensate each other. The fit is therefore made from several fixed starts. Returns the fit with
/// the smallest residual, in which outliers count at their limit. All starts take 0.1 to 0.5 s for 70 to 80 dots.
/// The outcome is kDiverged if no fit converged, no start was found, or fewer than GeometryOptions::fewest markers are
/// present; the rest has no meaning then. It is never kFewMarkers. Reentrant.
tractiond::calibrate::Geometry firstPose(const sensor::Sensor& sensor, const RestMarkers& markers);

/// Corrects labels that are wrong by whole columns or rows. Where a picture does not show the grid's rims, the sensor's
/// pose has decided on the labels, and a pose that is off by a pitch makes all of them wrong. Tries labels that are
/// moved by up to four columns and rows to each side, and returns those that a pose fits best. Only the places of a
/// body's markers show such an error, as they are not at equal distances in the picture; those of a block are returned
/// as they are. Takes about a second. Reentrant.
RestMarkers counted(const sensor::Sensor& sensor, RestMarkers markers);

/// Returns another aspect than the sensor's if it explains the markers' positions and the sensor's does not. Returns
/// nothing if the sensor's does, no aspect does, or no pose is found. The sensor's rotation is not used. Reentrant.
std::optional<tractiond::calibrate::AspectSeen> otherAspect(const sensor::Sensor& sensor, const RestMarkers& markers);

}  // namespace lens
