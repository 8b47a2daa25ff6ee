// Estimates the camera's pose and distortion from the pattern of the untouched markers.
#pragma once

#include "daemon/calibrate/picture_motion.h"

#include <string>
#include <vector>

namespace tractiond::calibrate {

/// Standard deviations of the pattern, by which the camera is measured, and of the camera's aspect.
struct GeometryOptions {
  double depth = 0.05e-3;   ///< of each layer's depth [m]: a good mould
  bool holdsFirst = false;  ///< true: depth and pitch of the first layer are those of the file
  double pitch = 3e-4;      ///< of each layer, relative: 20 um over the field
  double shift = 0.05e-3;   ///< of a layer's place relative to the first, in x and y [m]
  double aspect = 0.0;      ///< of the camera's aspect, relative; 0: the file's value is kept
  double outlier = 5.0;     ///< deviations; markers beyond (dust, a misplaced one) are not used
  double allowance_px =
      0.02;             ///< error of a lens that k1 and k2 do not describe; as large as the effect of a touch of 10 gf
  int fewest = 12;      ///< markers; fewer do not determine the pose
  int iterations = 60;  ///< at most; with a touch many are needed, without one five
};

/// Result of the fit. Unless it is kConverged, `camera` and `uncertainty` are those that the fit was given (the camera
/// of the file with the pose of the start), `markers` is the number of markers present, and the rest is 0 or empty.
struct Geometry {
  /// kFewMarkers: fewer than GeometryOptions::fewest are present or agree with each other. kDiverged: no camera was
  /// found within the iterations.
  enum class Outcome { kConverged, kFewMarkers, kDiverged };

  Outcome outcome = Outcome::kFewMarkers;
  sensor::Camera camera;            ///< focal length, principal point, k1, k2, position, rotation: new
  sensor::Uncertainty uncertainty;  ///< of focal length, position, rotation, and correlation: new
  double k1Deviation = 0.0, k2Deviation = 0.0;
  double principalDeviation_px = 0.0;  ///< the larger of those in u and v
  double aspectDeviation = 0.0;
  /// Depth, x and y of the second layer less those of the file, and their deviations [m]. 0: there is one layer.
  Eigen::Vector3d offset = Eigen::Vector3d::Zero(), offsetDeviation = Eigen::Vector3d::Zero();
  double residual_px = 0.0;  ///< root mean square over the coordinates that are used
  int markers = 0;           ///< number of markers used
  int outliers = 0;          ///< number of markers that are present, but not used
  Bulge bulge;               ///< smooth part of the residual of all markers: found() if something seems to touch
};

/// Estimates camera and pattern, maximum a posteriori, by Gauss-Newton. Minimises over both
///   sum over markers |seen - project(camera, pattern)|^2 / s^2 + sum (pattern error / its deviation)^2
///     + sum over focal length, principal point, k1, k2 ((number - file's) / (file's deviation))^2,
/// where s is the scatter of the residual. If GeometryOptions::aspect is above 0, the aspect is fitted too, with that
/// deviation. In a nearly flat pattern only the parallax of the layers separates focal
/// length from distance and principal point from lateral position, and it is as uncertain as the layers' depths. So the
/// file's focal length and its deviation matter, and the covariance states what remains unknown. Reentrant.
/// \param start gel, pattern and camera of the file; the iteration begins with its camera
/// \param seen_px 2 M, (u, v) of each marker, as in RestPose \param present M, 0 or 1; 0: the marker is ignored
Geometry fitGeometry(const sensor::Sensor& start, std::span<const float> seen_px, std::span<const std::uint8_t> present,
                     const GeometryOptions& options = {});

/// Does the same as fitGeometry(), but begins the iteration with pose, k1 and k2 of `from`. The deviations still refer
/// to the numbers of `file`.
Geometry fitGeometryFrom(const sensor::Camera& from, const sensor::Sensor& file, std::span<const float> seen_px,
                         std::span<const std::uint8_t> present, const GeometryOptions& options = {});

}  // namespace tractiond::calibrate
