// ZeroMQ sockets that peers connect to, with the limits that libzmq offers (docs/security.md). Functions with a socket
// are for that socket's thread, the others are thread-safe.
#pragma once

#include "base/error.h"

#include <tl/expected.hpp>
#include <zmq.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tractiond::network {

/// Sets the options that bound what a peer costs: a handshake takes 0.5 s at most, a TCP peer that reads nothing for 5
/// s while data waits for it is disconnected, and one that vanished within 30 s. The number of messages from peers is
/// not limited, as such a limit makes libzmq 4.3.4 abort (docs/protocol.md). Closing the socket's context then takes up
/// to 0.1 s. Must be called before bind(), which an option set later would not affect.
/// \throws zmq::error_t if the socket is not open
/// \param highWaterMark messages queued for one slow peer; further ones are lost
/// \param largestMessage bytes of one part from a peer; a peer that sends more is disconnected
void guard(zmq::socket_t& socket, int highWaterMark, std::int64_t largestMessage);

/// Binds a ROUTER or a publisher to all endpoints (tcp://ADDRESS:PORT, ADDRESS also localhost, PORT * for any free one,
/// or ipc://PATH in an existing directory) and returns them as bound. Replaces a socket file on which no process
/// listens (checkEndpoint()); the file's mode is 0660, and until that is set the one of the process's umask. The socket
/// must be guarded (guard()). Errors: EX_CONFIG for an endpoint that is not valid, EX_UNAVAILABLE if it is in use or
/// not an address of this machine, EX_CANTCREAT if its directory does not exist or another kind of file has its path,
/// EX_NOPERM. After an error the socket must be closed: endpoints before the faulty one are still bound.
tl::expected<std::vector<std::string>, Error> bind(zmq::socket_t& socket, const std::vector<std::string>& endpoints);

/// Removes the files of ipc endpoints, which ZeroMQ 4.3 leaves behind. Does not close the socket.
/// \param bound as bind() returned it
void release(const std::vector<std::string>& bound);

/// Returns the sender of a message as text for the log: its address, or "uid 1000, pid 4711" for a process on this
/// host (ipc), or "an unknown peer" if ZeroMQ does not know the address.
std::string peerName(zmq::message_t& message);

/// Receives the next message whole, without waiting, and keeps its first four parts; elements of `parts` without a part
/// are unchanged. Returns the number of its parts, which may exceed four; 0: there is none, or it cannot be received.
std::size_t receive(zmq::socket_t& socket, std::array<zmq::message_t, 4>& parts);

/// Queues one part of a message, without waiting; `part` is then empty. Returns whether it was queued: false, and
/// `part` stays as it is, if a DEALER has no peer or its queue is full. A ROUTER or publisher returns true, and drops
/// the message for the peers concerned.
/// \param more true: further parts follow
bool put(zmq::socket_t& socket, zmq::message_t& part, bool more);

/// Returns a property of a message, such as "Peer-Address"; empty if it has none of this name.
std::string property(zmq::message_t& message, const char* name);

/// Returns an item for zmq_poll() that becomes ready when there is something to receive.
inline zmq_pollitem_t readable(zmq::socket_t& socket) {
  return {.socket = socket.handle(), .fd = 0, .events = ZMQ_POLLIN, .revents = 0};
}

}  // namespace tractiond::network
