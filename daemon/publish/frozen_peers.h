// Ends the connections of subscribers that no longer read (stopped, hung, or gone without closing): the messages that
// wait for each take memory.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace tractiond::publish {

/// Thread-bound; does not wait. A subscriber whose connection was ended connects again when it continues to read.
class FrozenPeers {
 public:
  /// Number of file descriptors that one call examines: some 4 µs each on a busy machine.
  static constexpr int kMostAtOnce = 1024;

  /// \param bound endpoints of this program, as bound
  /// \param told called within endFrozen() with a line for the log, once a minute at most: the number of connections
  /// that this round has ended; those of other rounds in that minute are not reported \param mostAtOnce number of file
  /// descriptors that one call examines, above 0
  FrozenPeers(std::vector<std::string> bound, std::function<void(const std::string&)> told,
              int mostAtOnce = kMostAtOnce)
      : bound_(std::move(bound))
      , told_(std::move(told))
      , most_(mostAtOnce) {}

  /// Ends the connections to the bound endpoints whose unread bytes in the kernel (network::Unread) are not 0 and have
  /// not changed for 5 s, and whose peers have sent no request in this time: of a client that asks again and again, the
  /// last answer may wait at every look. Returns the memory of the messages that waited for them to the system, in this
  /// round and the two after it. A round over all file descriptors begins each second; with many descriptors it takes
  /// several calls. \param now_ns time of the call on any clock that does not go back, from 1 s on
  void endFrozen(std::int64_t now_ns);

 private:
  struct Connection {
    std::uint64_t socket = 0;  ///< the descriptor's number may be another's by now
    int waiting_bytes = 0;
    std::uint64_t sent = 0;  ///< parts of messages that the peer has sent
    std::int64_t since_ns = 0;
  };

  /// Returns whether the descriptor was a connection that nobody reads, which is ended then.
  bool endIfFrozen(int fd, std::int64_t now_ns);

  std::vector<std::string> bound_;
  std::function<void(const std::string&)> told_;
  int most_;
  std::map<int, Connection> connections_;  ///< those with unread bytes, by file descriptor
  int next_ = 0, end_ = 0;                 ///< descriptors of this round
  int frozen_ = 0;                         ///< connections that were ended in this round
  std::int64_t began_ns_ = 0, told_ns_ = 0;
  int trims_ = 0;  ///< number of releases of memory still to be done: ZeroMQ frees it later
};

}  // namespace tractiond::publish
