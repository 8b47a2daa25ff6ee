// ZeroMQ sockets that listen to anybody. ZeroMQ is seen by this room's socket, publisher and control files only.
#pragma once

#include "base/error.h"
#include "base/network/connection_limit.h"
#include "base/network/reply_budget.h"

#include <tl/expected.hpp>
#include <zmq.hpp>

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace tractiond::network {

/// Sets what protects a socket from its peers; before binding.
/// \param largestMessage bytes of one part from a peer; a peer that sends more is cut off.
void guard(zmq::socket_t& socket, int highWaterMark, std::int64_t largestMessage);

/// Binds a ROUTER or a publisher to all endpoints (tcp://ADDRESS:PORT, PORT * for any free one, or ipc://PATH in an
/// existing directory) and returns them as bound. A socket file that nobody listens on any more is replaced. What peers
/// can make ZeroMQ hold is bounded (inflow_limit.h) until release().
tl::expected<std::vector<std::string>, Error> bind(zmq::socket_t& socket, const std::vector<std::string>& endpoints);

/// Ends what bind() began: watches the endpoints' connections no more, and removes the files of ipc endpoints, which
/// ZeroMQ 4.3 leaves behind.
void release(const std::vector<std::string>& bound);

/// Who sent a message, for people: the address, or "uid 1000, pid 4711" of a process on this host.
std::string peerName(zmq::message_t& message);

/// Returns the file descriptor over which a message came; -1: it is not known.
int sourceOf(zmq::message_t& message);

/// Returns a message that tells `waiting` when ZeroMQ has let it go: it and its copies were written, or their peers
/// have gone.
zmq::message_t messageOf(std::string bytes, std::shared_ptr<ReplyBudget::Reply> waiting);

/// Ends a peer's connection to a socket bound to these endpoints. \param fd of the connection, as ZeroMQ says
/// \return whether it was one
bool cutOff(int fd, const std::vector<std::string>& bound);

/// Cuts off peers that send too much.
class PeerLimit {
 public:
  /// \param messages of one connection between two resets
  explicit PeerLimit(int messages)
      : limit_(messages) {}

  /// Counts a message that came over a socket bound to these endpoints; one too many ends its connection.
  void count(zmq::message_t& message, const std::vector<std::string>& bound);
  void reset() { counts_.fill(0); }

 private:
  int limit_;
  std::array<std::uint16_t, connections::kMostDescriptors> counts_{};  ///< by file descriptor
};

}  // namespace tractiond::network
