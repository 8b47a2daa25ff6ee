// Subscribers that read nothing any more: stopped, hung, or gone without a word. What waits for each costs memory.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace tractiond::publish {

/// Thread-bound; waits for nobody. A subscriber that was cut off comes back by itself when it reads again.
class FrozenPeers {
 public:
  /// \param bound endpoints of ours
  /// \param told what was done, a line for people
  FrozenPeers(std::vector<std::string> bound, std::function<void(const std::string&)> told)
      : bound_(std::move(bound))
      , told_(std::move(told)) {}

  /// Once a second: ends the connections of which the kernel has held the same bytes for five seconds, and gives the
  /// memory of what waited for them back.
  void look(std::int64_t now_ns);

 private:
  struct Connection {
    ino_t socket = 0;  ///< the descriptor's number may be another's by now
    int waiting_bytes = 0;
    std::int64_t since_ns = 0;
  };

  std::vector<std::string> bound_;
  std::function<void(const std::string&)> told_;
  std::map<int, Connection> connections_;  ///< by file descriptor
  std::int64_t looked_ns_ = 0, told_ns_ = 0;
  int trims_ = 0;  ///< still to come: ZeroMQ takes its time to free
};

}  // namespace tractiond::publish
