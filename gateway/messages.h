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

/// Receives the next message whole, without waiting, and keeps its first four parts; elements of `parts` without a part
/// are unchanged. Returns the number of its parts, which may exceed four; 0: there is none, or it cannot be received.
std::size_t receive(zmq::socket_t& socket, std::array<zmq::message_t, 4>& parts);

/// Queues one part of a message, without waiting; `part` is then empty. Returns whether it was queued: false, and
/// `part` stays as it is, if a DEALER has no peer or its queue is full. A ROUTER or publisher returns true, and drops
/// the message for the peers concerned. \param more true: further parts follow
bool put(zmq::socket_t& socket, zmq::message_t& part, bool more);

/// Queues [to][empty][body], whole or not at all, without waiting. Returns whether it was queued, as put().
bool putAddressed(zmq::socket_t& socket, std::string_view to, zmq::message_t body);

/// Returns a property of a message, such as "Peer-Address"; empty if it has none of this name.
std::string property(zmq::message_t& message, const char* name);

/// Routing text that the instrument returns with its reply, so that the reply finds the client.
struct Route {
  std::string peer;              ///< routing id of the client's connection on the front's control socket
  std::uint32_t generation = 0;  ///< opening of the front to which the connection belongs

  std::string text() const;  ///< Returns the route as bytes, from which of() restores it.
  /// Restores a route. Returns nothing if the text has not the lengths that it states; nothing else is checked.
  static std::optional<Route> of(std::string_view text);
};

}  // namespace tractiond::gateway
