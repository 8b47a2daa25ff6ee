// Multipart messages of ZeroMQ, received and sent without waiting.
#pragma once

#include <zmq.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace tractiond::gateway {

/// Receives the next message and keeps its first four parts. Returns the number of its parts; 0: there is none.
std::size_t receive(zmq::socket_t& socket, std::array<zmq::message_t, 4>& parts);

/// Sends one part of a message. Returns false if there is no peer, or its queue is full. \param more true: further
/// parts follow
bool put(zmq::socket_t& socket, zmq::message_t& part, bool more);
bool put(zmq::socket_t& socket, std::string_view text, bool more);

/// Returns a property of a message, such as "Peer-Address"; empty if it has none of this name.
std::string property(zmq::message_t& message, const char* name);

/// Routing text that the instrument returns with its reply: the routing id, followed by the client's name.
struct Route {
  std::string peer, who;
  int fd = -1;
  std::uint32_t generation = 0;  ///< opening of the front to which the connection belongs

  std::string text() const;  ///< Returns the route as bytes, from which of() restores it.
  /// Returns nothing if the text is not one of text().
  static std::optional<Route> of(std::string_view text);
};

}  // namespace tractiond::gateway
