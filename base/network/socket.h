// ZeroMQ sockets that peers connect to, with the limits that libzmq offers (docs/security.md). Functions with a socket
// are for that socket's thread, the others are thread-safe.
#pragma once

#include "base/error.h"

#include <tl/expected.hpp>
#include <zmq.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tractiond::network {

/// Sets the options that bound what a peer costs: a handshake takes 0.5 s at most, a TCP peer that reads nothing for 5
/// s while data waits for it is disconnected, and one that vanished within 30 s. The number of messages from peers is
/// not limited, as such a limit makes libzmq 4.3.4 abort (docs/protocol.md). Closing the socket's context then takes up
/// to 0.1 s. Must be called before bind(), which an option set later would not affect. \throws zmq::error_t if the
/// socket is not open \param highWaterMark messages queued for one slow peer; further ones are lost \param
/// largestMessage bytes of one part from a peer; a peer that sends more is disconnected
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

/// Returns an item for zmq_poll() that becomes ready when there is something to receive.
inline zmq_pollitem_t readable(zmq::socket_t& socket) {
  return {.socket = socket.handle(), .fd = 0, .events = ZMQ_POLLIN, .revents = 0};
}

}  // namespace tractiond::network
