#include "daemon/publish/reply_budget.h"

#include <linux/sockios.h>
#include <sys/ioctl.h>

namespace tractiond::publish {

bool ReplyBudget::isUnread(int fd) {
  int waiting = 0;
  return ioctl(fd, SIOCOUTQ, &waiting) == 0 && waiting > 0;
}

void ReplyBudget::forgetRead() {
  for (auto& [who, replies] : waiting_) {
    // acquire: partner is the release in messageOf(); it has been written by then, but perhaps not read.
    std::erase_if(replies, [this](const auto& reply) {
      return !reply->queued.load(std::memory_order_acquire) && !hasUnread_(reply->fd);
    });
  }
  std::erase_if(waiting_, [](const auto& of) { return of.second.empty(); });
}

bool ReplyBudget::allows(const std::string& who, std::uint64_t bytes) {
  forgetRead();
  std::uint64_t all = 0, each = 0;
  for (const auto& [name, replies] : waiting_) {
    for (const auto& reply : replies) {
      all += reply->bytes;
      if (name == who) each += reply->bytes;
    }
  }
  return each == 0 || (each + bytes <= mostEach_bytes_ && all + bytes <= most_bytes_);
}

std::shared_ptr<ReplyBudget::Reply> ReplyBudget::add(const std::string& who, int fd, std::uint64_t bytes) {
  auto reply = std::make_shared<Reply>();
  reply->fd = fd;
  reply->bytes = bytes;
  waiting_[who].push_back(reply);
  return reply;
}

}  // namespace tractiond::publish
