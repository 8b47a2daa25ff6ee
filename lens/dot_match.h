// Finds the pose from which markers without a grid, such as dots printed at random, look as they do in a picture.
#pragma once

#include "daemon/records/snapshot.h"
#include "sensor/sensor.h"

#include <optional>

namespace lens {

/// Returns the sensor's camera, turned about its axis by up to 10 degrees, 10 % nearer or farther, and moved sideways
/// by up to a fifth of the picture, so that most markers lie on spots of the picture: to a third of the markers'
/// distance. Nothing if no such pose stands out. Takes about a second.
std::optional<sensor::Camera> matchDots(const sensor::Sensor& sensor, const tractiond::PlainPicture& picture);

}  // namespace lens
