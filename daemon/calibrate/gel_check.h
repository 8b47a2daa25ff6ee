// Checks whether the rest picture shows the gel of the gel file: the number of markers, their pitch, the distance of
// the layers in depth, and the camera's pose.
#pragma once

#include "daemon/records/gel_report.h"
#include "sensor/sensor.h"

#include <cstdint>
#include <span>

namespace tractiond::calibrate {

/// Fits the camera's pose and distortion, and the second layer's place and depth, to the markers' places, and compares
/// them with the sensor's and its [uncertainty]. If a large residual remains, tries another aspect (seenAspect); if
/// that explains the places, the report has its finding and those of `seen` alone. If no camera of any aspect explains
/// the places, or too few markers are present or agree, it has those of `seen` alone, and a remark if the sensor has as
/// many markers as verify it. Takes tens of milliseconds. Reentrant.
/// \param place_px 2 M, as in RestPose
/// \param present M; 0: the marker is ignored
/// \param seen one per layer; empty: not known
/// \param judgesResidual false: any residual is accepted, and no other aspect is tried
GelReport checkGel(const sensor::Sensor& sensor, std::span<const float> place_px, std::span<const std::uint8_t> present,
                   std::span<const LatticeSeen> seen, bool judgesResidual = true);

}  // namespace tractiond::calibrate
