// What several of the messages and replies have within them.
#pragma once

#include "daemon/publish/wire.h"
#include "daemon/records/marker_field.h"
#include "sensor/sensor.h"
#include "traction/v1/description.pb.h"
#include "traction/v1/header.pb.h"

namespace tractiond::publish {

/// All of a header that does not change.
void encode(const Identity& identity, traction::v1::Header& header);
/// The rest of it.
void encode(const Heading& heading, traction::v1::Header& header);

void encode(const RestPose& from, traction::v1::Zero& to);

traction::v1::Colour wireColour(sensor::Colour colour);

}  // namespace tractiond::publish
