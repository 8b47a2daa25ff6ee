// Sets keys on a socket and interprets the outcome of its handshakes.
#pragma once

#include "traction/error.h"
#include "traction/keys.h"

#include <zmq.hpp>

#include <cstdint>
#include <optional>
#include <string>

namespace traction {

/// Monitor events that Handshake::process() needs.
inline constexpr int kHandshakeEvents = ZMQ_EVENT_HANDSHAKE_SUCCEEDED | ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL |
                                        ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL | ZMQ_EVENT_HANDSHAKE_FAILED_AUTH;

/// Sets the keys on a socket that is not connected yet. Does nothing without a server key.
/// \throws Error kBadKeys if one of the three is not 40 characters of Z85
void useKeys(zmq::socket_t& socket, const Keys& keys);

/// Tells from a socket's monitor events why a connection fails. Not thread-safe.
class Handshake {
 public:
  /// \param endpoint is named in errors
  /// \param hasKeys whether useKeys() has set keys
  Handshake(std::string endpoint, bool hasKeys)
      : endpoint_(std::move(endpoint))
      , hasKeys_(hasKeys) {}

  /// Processes the next monitor event; ignores kinds other than kHandshakeEvents.
  /// \param value of the event
  /// \return kNotAllowed, once it is certain that no connection is possible: at once if the peer refuses the key or has
  /// another security mechanism, or with keys after 5 connections that end without a reason before the first success;
  /// that count then begins anew. Nothing otherwise, as after other protocol failures.
  std::optional<Error> process(std::uint16_t event, std::uint32_t value);

 private:
  std::string endpoint_;
  bool hasKeys_;
  bool succeeded_ = false;
  int failures_ = 0;  ///< handshakes that failed without a stated reason
};

/// Returns the event and the value in the first part of a monitor message; both are 0 if the part is too short.
std::pair<std::uint16_t, std::uint32_t> eventOf(const zmq::message_t& message);

}  // namespace traction
