// ZeroMQ sockets that any peer may connect to. Functions with a socket are for that socket's thread, the others are
// thread-safe.
#pragma once

#include "base/error.h"
#include "base/network/reply_budget.h"

#include <tl/expected.hpp>
#include <zmq.hpp>

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tractiond::network {

/// Sets the options that protect a socket from its peers, among them TCP keep-alive and a limit of 0.5 s for a
/// handshake. The number of messages from peers is not limited: see bind(). Closing the socket's context then takes up
/// to 0.1 s. Must be called before bind(), which an option set later would not affect; until then no peer can connect.
/// \throws zmq::error_t if the socket is not open
/// \param highWaterMark messages queued for one slow peer; further ones are lost
/// \param largestMessage bytes of one part from a peer; a peer that sends more is cut off
void guard(zmq::socket_t& socket, int highWaterMark, std::int64_t largestMessage);

/// Binds a ROUTER or a publisher to all endpoints (tcp://ADDRESS:PORT, ADDRESS also localhost, PORT * for any free one,
/// or ipc://PATH in an existing directory) and returns them as bound. Replaces a socket file on which no process
/// listens (checkEndpoint()); the file's mode is 0660, and until that is set the one of the process's umask. The socket
/// must be guarded (guard()). Bounds what peers can make ZeroMQ hold (inflow_limit.h) until release(). Errors:
/// EX_CONFIG for an endpoint that is not valid, EX_UNAVAILABLE if it is in use or not an address of this machine,
/// EX_CANTCREAT if its directory does not exist or another kind of file has its path, EX_NOPERM. After an error the
/// socket must be closed: endpoints before the faulty one are still bound.
tl::expected<std::vector<std::string>, Error> bind(zmq::socket_t& socket, const std::vector<std::string>& endpoints);

/// Ends what bind() began: stops watching the endpoints' connections, and removes the files of ipc endpoints, which
/// ZeroMQ 4.3 leaves behind. Does not close the socket. \param bound as bind() returned it
void release(const std::vector<std::string>& bound);

/// Returns the sender of a message as text for the log: its address, or "uid 1000, pid 4711" for a process on this
/// host (ipc), or "an unknown peer" if ZeroMQ does not know the address.
std::string peerName(zmq::message_t& message);

/// Returns the file descriptor of the connection over which a message came; -1 if it is not known. The connection may
/// have ended since, and its number be that of another file. \param message a part that the peer sent: for the routing
/// id that a ROUTER adds, libzmq 4.3.4 knows no connection after zmq_poll() (router.cpp, xhas_in()). The same holds for
/// connectionOf() and PeerLimit
int sourceOf(zmq::message_t& message);

/// Returns a pointer, not to be dereferenced, that the messages of one connection have in common, and those of no other
/// connection as long as one of these messages, or a copy, exists. nullptr if the message came over no connection.
const void* connectionOf(zmq::message_t& message);

/// Returns a message of these bytes that clears waiting->queued when ZeroMQ frees it: it and its copies were written,
/// or their peers have gone. ZeroMQ's thread clears it. Without a value if ZeroMQ has no memory for it; it is cleared
/// then. \param waiting from ReplyBudget::add(); kept until then
std::optional<zmq::message_t> messageOf(std::string bytes, std::shared_ptr<ReplyBudget::Reply> waiting);

/// Returns a message with a copy of these bytes; without a value if ZeroMQ has no memory for it.
std::optional<zmq::message_t> copyOf(std::string_view bytes);

/// Returns an item for zmq_poll() that becomes ready when there is something to receive.
inline zmq_pollitem_t readable(zmq::socket_t& socket) {
  return {.socket = socket.handle(), .fd = 0, .events = ZMQ_POLLIN, .revents = 0};
}

/// Must be called for each message that a publisher's socket receives. Keeps its charge (inflow_limit.h) if it begins a
/// subscription, which ZeroMQ holds from now on; releases it otherwise. \param isKnown it is to a topic of this
/// publisher, or to all that begin alike: ZeroMQ holds nothing more for it
void settleSubscription(zmq::message_t& message, bool isKnown);

/// Returns whether a file descriptor is a connection to one of these endpoints; false also if it has ended. \param
/// bound as bind() returned it
bool isConnectionTo(int fd, const std::vector<std::string>& bound);

/// Ends a peer's connection, for both directions. Returns whether it did: false if `fd` is no connection to one of
/// these endpoints, or has ended. \param fd of the connection, as sourceOf() returned it \param bound as bind()
/// returned it
bool cutOff(int fd, const std::vector<std::string>& bound);

/// Cuts off peers that send too many messages. Thread-bound.
class PeerLimit {
 public:
  /// \param messages allowed per connection between two calls of reset()
  explicit PeerLimit(int messages)
      : limit_(messages) {}

  /// Counts a message that came over a socket bound to these endpoints. Ends its connection (cutOff()) if it exceeds
  /// the limit; a later connection with the same descriptor only if that has sent as much itself. Has no effect if the
  /// connection is not known. Allocates, and keeps a copy of a connection's first message until reset(), unless it is
  /// larger than 8 KiB: then a later connection may be counted together with this one.
  /// \param parts number of parts of the message that came over the connection \param bound as bind() returned it
  void count(zmq::message_t& message, std::size_t parts, const std::vector<std::string>& bound);
  void reset() { counts_.clear(); }  ///< Sets the counts of all connections to 0.

 private:
  struct Count {
    zmq::message_t first;  ///< kept for connectionOf()
    int messages = 0;
    std::size_t parts = 0;
  };

  int limit_;
  std::map<const void*, Count> counts_;  ///< by connectionOf()
};

}  // namespace tractiond::network
