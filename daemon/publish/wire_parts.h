// Encodes parts that several messages and replies have in common.
#pragma once

#include "daemon/publish/wire.h"
#include "daemon/records/marker_field.h"
#include "sensor/sensor.h"
#include "traction/v1/description.pb.h"
#include "traction/v1/header.pb.h"

#include <array>

namespace tractiond::publish {

/// Sets the fields of a header that do not change: sensor, boot and calibration.
void encode(const Identity& identity, traction::v1::Header& header);
/// Sets the other fields of a header, from all of the heading but `sentReal_ns`, which no header has.
void encode(const Heading& heading, traction::v1::Header& header);

/// Sets timestamp and header of a description, but its identity; its zero is the description's, not the heading's.
void encode(const Heading& heading, traction::v1::Description& message);

/// Encodes id, time and requester of a zero, and places and presence of its markers; replaces what `to` has of these.
void encode(const RestPose& from, traction::v1::Zero& to);

/// Encodes the detection limit of a force on a node, along the surface and into it [N].
void encode(const std::array<double, 2>& detectionLimit_N, traction::v1::Solver& to);

/// Returns the enumerator of a colour in messages.
traction::v1::Colour wireColour(sensor::Colour colour);

}  // namespace tractiond::publish
