// Bounds the memory that peers make ZeroMQ hold. ZeroMQ collects the parts of a message until the last, and complete
// messages until they are taken, without a limit of its own. Therefore this program's own recv() measures what ZeroMQ
// reads: a peer whose frames would cost too much is cut off before ZeroMQ sees them
// (docs/decisions/0030-unfinished-messages.md).
#pragma once

#include "base/network/frame_meter.h"

#include <cstdint>
#include <string>
#include <vector>

namespace tractiond::network::inflow {

inline constexpr std::uint64_t kMost_bytes = 1 << 20;          ///< limit of one connection
inline constexpr std::uint64_t kMostTogether_bytes = 8 << 20;  ///< of all; above it the largest connection is ended

// Every function is thread-safe.

/// Applies the limits to the connections that are accepted at this endpoint (tcp://ADDRESS:PORT, ipc://PATH) from now
/// on: what each frame costs is charged to its connection until release(). An endpoint is identified by its port or
/// path alone. Each call needs an unwatch() of its own.
void watch(const std::string& endpoint, Charge charge);
/// Ends one watch() of each endpoint; ignores endpoints that are not watched. When none is left, forgets all charges.
void unwatch(const std::vector<std::string>& endpoints);

/// Must be called for each message that was taken out of ZeroMQ's queues, unless ZeroMQ holds what it said, a
/// subscription. Releases the charge of the connection for it: the mean charge of its frames for each part. Notes if
/// recv() or accept() was not seen, for Report.
/// \param fd of the connection, as ZeroMQ reports it; -1, or one without a charge, releases nothing
/// \param parts number of parts of the message that came over the connection; more than were charged release all. If
/// the descriptor is a later connection's by now, that one's charge is lowered
void release(int fd, std::size_t parts);

/// Returns how many parts of messages the connection has sent that has this descriptor now; 0 if there is none. Without
/// information, as recv() is bypassed, or the descriptor is -1 or too large, the largest number.
std::uint64_t sentOver(int fd);

/// Releases the charges of connections that have ended, whose messages may still wait in ZeroMQ's queues. Must be
/// called when ZeroMQ has no more messages of this kind there. Above kMostTogether_bytes of these charges, every
/// connection of the kind is ended that sends another frame.
void releaseEnded(Charge charge);

/// Returns the number of connections that were ended by these limits since the start of the program.
std::uint64_t ended();

/// Reports the connections that are ended after its construction, and once that the limits are not in force, if so.
/// Thread-bound.
class Report {
 public:
  /// Gives memory of ended connections back to the system, at most once a second: a call within a second of the one
  /// before does nothing. \param now_ns CLOCK_MONOTONIC
  /// \return a line for the log; empty if there is nothing to report, or if the last line was less than a minute ago
  std::string nextLine(std::int64_t now_ns);

 private:
  std::uint64_t seen_ = ended(), told_ = seen_;
  std::int64_t called_ns_ = 0, told_ns_ = 0;
  bool saidBypassed_ = false;
  int trims_ = 0;  ///< number still to be done: ZeroMQ frees memory later
};

}  // namespace tractiond::network::inflow
