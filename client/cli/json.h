// Messages as JSON objects on one line, keys as in proto/traction/v1; the header's keys stand beside the others.
#pragma once

#include "traction/control.h"
#include "traction/subscriber.h"

#include <array>
#include <cstdint>
#include <string>
#include <utility>

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

// Words of the messages.
const char* nameOf(CameraState state);  ///< "streaming"
const char* nameOf(Colour colour);      ///< "blue"
/// The parts of Ledger::losses() by their causes, "wrong_size".
std::array<std::pair<const char*, std::uint64_t>, 11> lossesOf(const Ledger& ledger);
/// "priority 19 to 20 on 2-3, memory locked"; "off"
std::string grantedOf(const Scheduling& scheduling);
/// "priority 20, memory": asked and not granted; empty: nothing.
std::string refusedOf(const Scheduling& scheduling);

}  // namespace traction::cli
