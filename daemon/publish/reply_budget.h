// How many bytes of replies wait for peers that do not read them.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace tractiond::publish {

/// Of each who asks (a key, a user, an address) and of all together. Thread-bound.
class ReplyBudget {
 public:
  /// A reply on its way.
  struct Reply {
    std::atomic<bool> queued{true};  ///< ZeroMQ has it; cleared by its thread
    int fd = -1;                     ///< of the connection
    std::uint64_t bytes = 0;
  };

  /// \param hasUnread says whether the kernel holds something of a connection that its peer has not read.
  ReplyBudget(std::uint64_t most_bytes, std::uint64_t mostEach_bytes, std::function<bool(int fd)> hasUnread = isUnread)
      : most_bytes_(most_bytes)
      , mostEach_bytes_(mostEach_bytes)
      , hasUnread_(std::move(hasUnread)) {}

  /// Whether so many bytes more may wait for `who`. One reply of any size may wait where none does.
  bool allows(const std::string& who, std::uint64_t bytes);

  /// Counts a reply until ZeroMQ has let it go and its connection holds nothing unread.
  std::shared_ptr<Reply> add(const std::string& who, int fd, std::uint64_t bytes);

 private:
  static bool isUnread(int fd);
  void forgetRead();

  std::uint64_t most_bytes_, mostEach_bytes_;
  std::function<bool(int fd)> hasUnread_;
  std::map<std::string, std::vector<std::shared_ptr<Reply>>> waiting_;  ///< by who asked
};

}  // namespace tractiond::publish
