#include "daemon/publish/frozen_peers.h"

#include "base/network/ends.h"
#include "base/network/inflow_limit.h"
#include "base/network/socket.h"

#include <malloc.h>

#include <algorithm>
#include <string>

namespace tractiond::publish {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr std::int64_t kPatience_ns = 5 * kSecond_ns;
constexpr std::int64_t kBetweenLines_ns = 60 * kSecond_ns;

}  // namespace

/// Examines one descriptor. Returns whether it was a connection that nobody reads, which is ended then.
bool FrozenPeers::endIfFrozen(int fd, std::int64_t now_ns) {
  const auto unread = network::unreadOf(fd);
  const auto known = connections_.find(fd);
  if (!unread || unread->bytes == 0) {
    if (known != connections_.end()) connections_.erase(known);
    return false;
  }
  const std::uint64_t sent = network::inflow::sentOver(fd);
  if (known == connections_.end() || known->second.socket != unread->socket ||
      known->second.waiting_bytes != unread->bytes || known->second.sent != sent) {
    connections_[fd] = {unread->socket, unread->bytes, sent, now_ns};
    return false;
  }
  if (now_ns - known->second.since_ns < kPatience_ns || !network::cutOff(fd, bound_)) return false;
  connections_.erase(known);
  return true;
}

void FrozenPeers::endFrozen(std::int64_t now_ns) {
  if (next_ >= end_) {  // a round is done
    if (now_ns - began_ns_ < kSecond_ns) return;
    began_ns_ = now_ns;
    next_ = frozen_ = 0;
    end_ = network::endOfDescriptorTable();
  }
  for (const int end = std::min(end_, next_ + most_); next_ < end; ++next_)
    frozen_ += endIfFrozen(next_, now_ns) ? 1 : 0;
  if (next_ < end_) return;
  if (frozen_ > 0) {
    trims_ = 3;
    if (told_ns_ == 0 || now_ns - told_ns_ >= kBetweenLines_ns) {
      told_ns_ = now_ns;
      told_(std::to_string(frozen_) +
            " subscribers have read nothing for 5 s, and are cut off until they connect again");
    }
  }
  if (trims_ > 0) {
    --trims_;
    malloc_trim(0);
  }
}

}  // namespace tractiond::publish
