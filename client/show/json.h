// Converts messages to JSON objects of one line. Keys are mostly those of proto/traction/v1; the header's are at the
// top level, with "topic", the kind of the message ("field"), and "arrived_ns". In a description "rest_pose" is the
// zero of the protocol, "calibration_time_ns" is calibration.time_ns, "same_host" stands for host and "contrast" for
// darker.
#pragma once

#include "traction/control.h"
#include "traction/subscriber.h"

#include <string>

namespace traction::client {

// These return a JSON object without a line end. Numbers that are not finite become null. A Status must have a message.
// A ZeroResult is written without rest positions.
std::string toJson(const Message& message);
std::string toJson(const ZeroResult& result);
/// The figures are one object, by their names.
/// \param step name of the step, part of the object
std::string toJson(const std::string& step, const CalibrationReport& report);

/// Each value is a number, true, false or text, by the kind of the feature; null if there is none.
std::string toJson(const CameraReport& report);
/// Returns 32 lower-case hexadecimal digits; empty if the id is all zero.
std::string toHex(const Id& id);

}  // namespace traction::client
