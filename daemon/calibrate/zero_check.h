// What one zero tells of another, and of the gel.
#pragma once

#include "daemon/calibrate/picture_motion.h"
#include "daemon/records/marker_field.h"
#include "sensor/sensor.h"

#include <string>

namespace tractiond::calibrate {

/// How the whole picture has moved from one zero to another, for people; empty where no markers are in both.
std::string movedBetween(const sensor::Sensor& sensor, const RestPose& before, const RestPose& after);

/// What touches the gel in a zero and did not in the one before: empty, or a sentence for people. What moves the whole
/// picture is no touch, nor is what heat and creep do.
std::string touchSince(const sensor::Sensor& sensor, const RestPose& before, const RestPose& after);

/// What seems to touch the gel in this zero, by the gel file alone: empty, or a sentence for people.
std::string touchIn(const sensor::Sensor& sensor, const RestPose& zero);

/// A sentence for people.
std::string touching(const Bulge& bulge);

}  // namespace tractiond::calibrate
