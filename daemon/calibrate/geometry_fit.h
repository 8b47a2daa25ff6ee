// Where the camera is and how it distorts, from the pattern of the untouched markers.
#pragma once

#include "daemon/calibrate/picture_motion.h"

#include <string>
#include <vector>

namespace tractiond::calibrate {

/// How well the pattern is known that all is measured with, and what is known of the camera besides: deviations.
struct GeometryOptions {
  double depth = 0.05e-3;      ///< of each layer [m]: a good mould
  double pitch = 3e-4;         ///< of each layer, relative: 20 um over the field
  double shift = 0.05e-3;      ///< of a layer against the first, in x and y [m]
  double aspect = 0.0;         ///< of the camera's aspect, relative; 0: it is as the file has it
  double outlier = 5.0;        ///< deviations: markers beyond (dust, a misplaced one) do not count
  double allowance_px = 0.02;  ///< of a lens that k1 and k2 do not describe; a touch of some 10 gf shows as much
  int fewest = 50;             ///< markers: with fewer, the fit says nothing of the lens
  int iterations = 60;         ///< a touch makes them many; without one five do
};

/// What became of it.
struct Geometry {
  enum class Outcome { kConverged, kFewMarkers, kDiverged };

  Outcome outcome = Outcome::kFewMarkers;
  sensor::Camera camera;            ///< focal length, principal point, k1, k2, position, rotation: new
  sensor::Uncertainty uncertainty;  ///< of focal length, position, rotation, and correlation: new
  double k1Deviation = 0.0, k2Deviation = 0.0;
  double principalDeviation_px = 0.0;
  double aspectDeviation = 0.0;
  double residual_px = 0.0;  ///< root mean square over the coordinates that count
  int markers = 0;           ///< that count
  int outliers = 0;
  Bulge bulge;  ///< the smooth part of the residual: found() if something seems to touch
};

/// Maximum a posteriori by Gauss-Newton: minimises over camera and pattern
///   sum over markers |seen - project(camera, pattern)|^2 / s^2 + sum (pattern error / its deviation)^2
///     + sum over focal length, principal point, k1, k2 ((number - file's) / (file's deviation))^2,
/// s being the scatter that is left. Focal length and distance, principal point and lateral position are nearly one in
/// a pattern that is nearly flat: only the parallax of the layers tells them apart, and it is as uncertain as the
/// layers' depths. So the file's focal length and its deviation matter, and the covariance says what remains unknown.
/// Reentrant. \param seen_px 2 M, as in RestPose
Geometry fitGeometry(const sensor::Sensor& start, std::span<const float> seen_px, std::span<const std::uint8_t> present,
                     const GeometryOptions& options = {});

/// The same from another start: the iteration begins with the pose and the distortion of `from`, while the numbers that
/// the deviations refer to stay those of `file`.
Geometry fitGeometryFrom(const sensor::Camera& from, const sensor::Sensor& file, std::span<const float> seen_px,
                         std::span<const std::uint8_t> present, const GeometryOptions& options = {});

}  // namespace tractiond::calibrate
