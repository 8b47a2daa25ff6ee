// What several of the messages and replies have within them.
#pragma once

#include "daemon/records/marker_field.h"
#include "sensor/sensor.h"
#include "traction/v1/description.pb.h"

namespace tractiond::publish {

void encode(const RestPose& from, traction::v1::Zero& to);

traction::v1::Colour wireColour(sensor::Colour colour);

}  // namespace tractiond::publish
