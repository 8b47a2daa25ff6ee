// What all messages have in their headers.
#pragma once

#include "traction/subscriber.h"

#include <cstdint>
#include <variant>

namespace traction::client {

/// Returns the header of a message of any type; it refers to the message.
inline const Header& headerOf(const Message& message) {
  return std::visit([](const auto& any) -> const Header& { return any.header; }, message);
}

/// Returns when the camera captured the frame of a field, markers, preview, contacts or grasp message [ns since 1970],
/// by the clock of the daemon's host; if that is not known, when the daemon received it. Returns `otherwise` for other
/// messages, and for frames of which neither is known.
inline std::uint64_t captureTime_ns(const Message& message, std::uint64_t otherwise) {
  const bool isAboutFrame = std::holds_alternative<Field>(message) || std::holds_alternative<Markers>(message) ||
                            std::holds_alternative<Preview>(message) || std::holds_alternative<Contacts>(message) ||
                            std::holds_alternative<Grasp>(message);
  const Header& header = headerOf(message);
  if (!isAboutFrame || header.receivedReal_ns <= 0) return otherwise;
  const std::int64_t age_ns = header.captured_ns != 0 ? header.received_ns - header.captured_ns : 0;
  return static_cast<std::uint64_t>(header.receivedReal_ns - age_ns);
}

}  // namespace traction::client
