// Messages as JSON objects on one line, keys as in proto/traction/v1; the header's keys stand beside the others.
#pragma once

#include "traction/control.h"
#include "traction/subscriber.h"

namespace traction::cli {

std::string toJson(const Message& message);
std::string toJson(const Status& status);
std::string toJson(const Description& description);
std::string toJson(const ZeroResult& result);
std::string toJson(const std::string& step, const CalibrationReport& report);

/// A value as a number, true, false or text, by its kind; null where there is none.
std::string toJson(const CameraReport& report);
/// 32 lower-case digits; empty where there is no id.
std::string toHex(const Id& id);

}  // namespace traction::cli
