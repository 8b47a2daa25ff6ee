// Checks whether the rest picture shows the gel of the gel file: the number of markers, their pitch, the distance of
// the layers in depth, and the camera's pose.
#pragma once

#include "daemon/records/gel_report.h"
#include "sensor/sensor.h"

#include <cstdint>
#include <span>

namespace tractiond::calibrate {

/// Limits beyond which the gel is reported as another one. The deviations are the gel file's [uncertainty], which does
/// not cover the pattern. After a calibration the pose is known so well that heat would be reported: hence the floors.
struct GelCheckOptions {
  double alarm = 5.0;      ///< deviations; at 5 a gel within its stated uncertainty is reported once in 2e5 zeros
  double pitch = 3e-4;     ///< deviation of the pitch, relative
  double offset = 0.1e-3;  ///< deviation of a layer's place relative to the first, in x and in y [m]
  double leastPosition = 0.1e-3;  ///< floor of the deviation of the camera's position [m] ...
  double leastRotation = 1e-3;    ///< ... rotation [rad] ...
  double leastDistance = 1e-3;    ///< ... scale of the picture, relative ...
  double leastDepth = 0.05e-3;    ///< ... and of a layer's depth [m]
  double aspect = 3e-3;           ///< deviation of the aspect, relative: as of the pitch in x against that in y
  double suspicious_px = 0.2;     ///< residual above which another aspect is tried
  int aspectIterations = 15;      ///< of each of its fits
  double largestResidual = 0.1;   ///< root mean square, share of the spacing; a larger one shows another pattern,
                                  ///< unless the file states such a deviation of the markers' places
};

/// Fits the camera's pose and distortion, and the second layer's place and depth, to the markers' places, and compares
/// them with the sensor's. If a large residual remains, tries another aspect (seenAspect); if that explains the places,
/// the report has its finding and those of `seen` alone. If no camera of any aspect explains the places, or fewer than
/// 50 markers are present or agree, it has those of `seen` alone, and a remark. Takes tens of milliseconds. Reentrant.
/// \param place_px 2 M, as in RestPose \param present M; 0: the marker is ignored \param seen one per layer; empty: not
/// known
GelReport checkGel(const sensor::Sensor& sensor, std::span<const float> place_px, std::span<const std::uint8_t> present,
                   std::span<const LatticeSeen> seen, const GelCheckOptions& options = {});

}  // namespace tractiond::calibrate
