// Why markers are not found: what the picture shows instead.
#pragma once

#include "daemon/records/marker_sight.h"
#include "daemon/records/snapshot.h"
#include "sensor/sensor.h"

#include <string>

namespace tractiond::track {

/// For people: "blue: 3 of 576, red: 0 of 576; the picture is dark: its brightest pixel has 12 of 255". Allocates,
/// takes a second at most: never on the frames' way. Reentrant.
std::string diagnose(const sensor::Sensor& sensor, const MarkerSight& sight, const PlainPicture& picture);

}  // namespace tractiond::track
