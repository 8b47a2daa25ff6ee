// Converts messages to JSON objects of one line. Keys are those of proto/traction/v1; the header's keys are at the top
// level.
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

/// Writes each value as a number, true, false or text, by its kind; null if there is none.
std::string toJson(const CameraReport& report);
/// Returns 32 lower-case hexadecimal digits; empty if the id is all zero.
std::string toHex(const Id& id);

// Words for values of messages.
const char* nameOf(CameraState state);  ///< "streaming"
const char* nameOf(Colour colour);      ///< "blue"
/// Returns the parts of Ledger::losses() with their names, such as "wrong_size".
std::array<std::pair<const char*, std::uint64_t>, 11> lossesOf(const Ledger& ledger);
/// Returns what the kernel grants: "priority 19 to 20 on 2-3, memory locked"; "off" if nothing.
std::string grantedOf(const Scheduling& scheduling);
/// Returns what was configured but not granted: "priority 20, memory"; empty: nothing.
std::string refusedOf(const Scheduling& scheduling);

}  // namespace traction::cli
