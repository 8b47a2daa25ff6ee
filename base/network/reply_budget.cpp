#include "base/network/reply_budget.h"

#include "base/network/ends.h"

#include <iterator>

namespace tractiond::network {

bool ReplyBudget::isUnread(int fd) {
  const auto unread = unreadOf(fd);
  return unread && unread->bytes > 0;
}

/// Forgets the replies of one connection that have been read. Returns the number of bytes that still wait.
std::uint64_t ReplyBudget::forgetRead(int fd, Connection& connection) const {
  std::uint64_t queued_bytes = 0;
  std::erase_if(connection.queued, [&](const auto& reply) {
    // acquire: partner is the release in messageOf(); it has been written by then, but perhaps not read.
    const bool isQueued = reply->queued.load(std::memory_order_acquire);
    (isQueued ? queued_bytes : connection.written_bytes) += reply->bytes;
    return !isQueued;
  });
  if (connection.written_bytes > 0 && !hasUnread_(fd)) connection.written_bytes = 0;
  return queued_bytes + connection.written_bytes;
}

void ReplyBudget::forgetRead() {
  all_bytes_ = 0;
  for (auto& [requester, share] : waiting_) {
    share.bytes = 0;
    for (auto one = share.connections.begin(); one != share.connections.end();) {
      const std::uint64_t bytes = forgetRead(one->first, one->second);
      share.bytes += bytes;
      one = bytes == 0 && one->second.queued.empty() ? share.connections.erase(one) : std::next(one);
    }
    all_bytes_ += share.bytes;
  }
  std::erase_if(waiting_, [](const auto& of) { return of.second.connections.empty(); });
}

bool ReplyBudget::allows(const std::string& requester, std::uint64_t bytes) const {
  const auto share = waiting_.find(requester);
  const std::uint64_t each_bytes = share == waiting_.end() ? 0 : share->second.bytes;
  return each_bytes == 0 || (each_bytes + bytes <= mostEach_bytes_ && all_bytes_ + bytes <= most_bytes_);
}

std::shared_ptr<ReplyBudget::Reply> ReplyBudget::add(const std::string& requester, int fd, std::uint64_t bytes) {
  auto reply = std::make_shared<Reply>();
  reply->bytes = bytes;
  Share& share = waiting_[requester];
  share.connections[fd].queued.push_back(reply);
  share.bytes += bytes;
  all_bytes_ += bytes;
  return reply;
}

}  // namespace tractiond::network
