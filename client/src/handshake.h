// Coming in with a key, and being told why not.
#pragma once

#include "traction/error.h"
#include "traction/keys.h"

#include <zmq.hpp>

#include <cstdint>
#include <optional>
#include <string>

namespace traction {

/// What of a socket's monitor take() wants to see.
inline constexpr int kHandshakeEvents = ZMQ_EVENT_HANDSHAKE_SUCCEEDED | ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL |
                                        ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL | ZMQ_EVENT_HANDSHAKE_FAILED_AUTH;

/// Has a socket use them. Before it connects. \throws Error kBadKeys
void useKeys(zmq::socket_t& socket, const Keys& keys);

/// What becomes of a connection, by the events of its monitor.
class Handshake {
 public:
  /// \param strangers so many without anybody else in between, who speak of other security than this side, are no
  /// chance
  Handshake(std::string endpoint, bool hasKeys, int strangers)
      : endpoint_(std::move(endpoint))
      , hasKeys_(hasKeys)
      , strangers_(strangers) {}

  /// \return why there is no connection, if that is certain
  std::optional<Error> take(std::uint16_t event, std::uint32_t value);

 private:
  std::string endpoint_;
  bool hasKeys_;
  int strangers_;
  bool succeeded_ = false;
  int failures_ = 0, mismatches_ = 0;  ///< without a word; of security
};

/// Event and value of a monitor's message.
std::pair<std::uint16_t, std::uint32_t> eventOf(const zmq::message_t& message);

}  // namespace traction
