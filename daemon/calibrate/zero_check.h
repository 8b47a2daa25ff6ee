// Compares a zero with the zero before it and with the gel file, and describes the differences to an operator.
//
// Reentrant. All texts are sentences without a full stop.
#pragma once

#include "daemon/calibrate/picture_motion.h"
#include "daemon/records/marker_field.h"
#include "sensor/sensor.h"

#include <string>

namespace tractiond::calibrate {

/// Describes shift [px], scale and roll [rad] of the whole picture from `before` to `after`, and the rms of what
/// remains, however small they are. Returns an empty text if fewer than ten markers are in both.
std::string movedBetween(const sensor::Sensor& sensor, const RestPose& before, const RestPose& after);

/// Describes a touch that `after` shows and `before` does not; empty if there is none, or if fewer than ten markers are
/// in both. Motion of the whole picture is not a touch, nor is a smooth displacement as small as heat and creep cause.
std::string touchSince(const sensor::Sensor& sensor, const RestPose& before, const RestPose& after);

/// Describes what seems to touch the gel in this zero, by the gel file alone (fitGeometry). Returns an empty
/// text if nothing does, if the fit fails, and for a body with an influence file.
std::string touchIn(const sensor::Sensor& sensor, const RestPose& zero);

/// Describes by how much the gel may still be displaced by earlier loads, if that is more than heat does; else, or if
/// its creep is not known, empty.
std::string recovering(const MarkerField& markers);

/// Describes a bulge as a touch, with its place and size. The bulge must be found(): this function does not check it.
std::string touching(const Bulge& bulge);

}  // namespace tractiond::calibrate
