// Bounds the memory that peers make ZeroMQ hold. ZeroMQ collects the parts of a message until its last, and whole
// messages until they are taken, without a limit of its own. So its reads are looked at (recv() of this program is
// ours): a peer whose frames would cost too much is cut off before ZeroMQ sees them
// (docs/decisions/0030-unfinished-messages.md).
#pragma once

#include "base/network/frame_meter.h"

#include <cstdint>
#include <string>
#include <vector>

namespace tractiond::network::inflow {

inline constexpr std::uint64_t kMost_bytes = 1 << 20;          ///< of one connection
inline constexpr std::uint64_t kMostTogether_bytes = 8 << 20;  ///< of all; beyond it the one that holds most is ended

// Every function is thread-safe.

/// Watches the connections that are accepted at this endpoint (tcp://ADDRESS:PORT, ipc://PATH), from now on.
void watch(const std::string& endpoint, Charge charge);
/// Ends that. When no endpoint is left, forgets what the connections of all were charged.
void unwatch(const std::vector<std::string>& endpoints);

/// Releases what a connection was charged for a message of so many parts: it was taken out of ZeroMQ's queues, and
/// nothing of it is kept. \param fd of the connection, as ZeroMQ says
void release(int fd, std::size_t parts);

/// Releases what connections that have ended were charged: ZeroMQ has no more messages of this kind in its queues.
void releaseEnded(Charge charge);

/// Number of connections that were ended since the start of the program.
std::uint64_t ended();

/// Tells people of the connections that are ended from its construction on, and once where the limits are not in force.
/// Thread-bound.
class Report {
 public:
  /// Gives memory of connections that were ended back to the system; once a second, if called more often.
  /// \return what was done, a line for people; empty: nothing, or the last line was less than a minute ago
  std::string look(std::int64_t now_ns);

 private:
  std::uint64_t seen_ = ended(), told_ = seen_;
  std::int64_t looked_ns_ = 0, told_ns_ = 0;
  bool saidBypassed_ = false;
  int trims_ = 0;  ///< still to come: ZeroMQ takes its time to free
};

}  // namespace tractiond::network::inflow
