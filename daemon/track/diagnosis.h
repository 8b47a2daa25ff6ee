// Explains to an operator why markers are not found.
#pragma once

#include "daemon/records/marker_sight.h"
#include "daemon/records/snapshot.h"
#include "sensor/sensor.h"

#include <string>

namespace tractiond::track {

/// Describes what was found and, of layers with fewer than half of their markers, what the picture shows instead:
/// "blue: 3 of 576 markers, red: 0 of 576 markers; the picture is dark: ...". Only the numbers if all layers have more,
/// or the picture is empty. Allocates and takes up to a second: not for the threads that process frames. Reentrant.
/// \param sight of the same frame as `picture`, or of one near it
/// \param picture of plainPicture()
std::string diagnose(const sensor::Sensor& sensor, const MarkerSight& sight, const PlainPicture& picture);

}  // namespace tractiond::track
