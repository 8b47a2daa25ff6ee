// Limits the bytes of replies that wait for peers that do not read them.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace tractiond::network {

/// Counts the bytes that wait, for each requester (a key, a user, an address) and for all together. Thread-bound.
class ReplyBudget {
 public:
  /// A reply that has not arrived yet.
  struct Reply {
    std::atomic<bool> queued{true};  ///< ZeroMQ has it; cleared by its thread
    std::uint64_t bytes = 0;
  };

  /// \param most_bytes limit of all requesters together \param mostEach_bytes of one
  /// \param hasUnread returns whether the kernel holds bytes of a connection that its peer has not read; called by
  /// forgetRead(); by default asks the kernel (unreadOf())
  ReplyBudget(std::uint64_t most_bytes, std::uint64_t mostEach_bytes, std::function<bool(int fd)> hasUnread = isUnread)
      : most_bytes_(most_bytes)
      , mostEach_bytes_(mostEach_bytes)
      , hasUnread_(std::move(hasUnread)) {}

  /// Returns whether so many bytes more may wait for a requester, within both limits. If nothing waits for it, the
  /// answer is true for any number of bytes, whatever waits for others.
  bool allows(const std::string& requester, std::uint64_t bytes) const;

  /// Forgets the replies that ZeroMQ has freed and whose connections hold nothing unread, or have ended: they do not
  /// count any more. Makes a system call for each connection: should be called once per turn, not for each request.
  void forgetRead();

  /// Counts a reply until forgetRead() forgets it; does not check the limits. Returns what messageOf() needs, to state
  /// when ZeroMQ has freed the reply. \param fd of its connection \param bytes size of the reply
  std::shared_ptr<Reply> add(const std::string& requester, int fd, std::uint64_t bytes);

 private:
  struct Connection {
    std::vector<std::shared_ptr<Reply>> queued;  ///< held by ZeroMQ
    std::uint64_t written_bytes = 0;             ///< handed to the kernel, and perhaps not read
  };
  struct Share {
    std::map<int, Connection> connections;  ///< by file descriptor
    std::uint64_t bytes = 0;                ///< of all of them
  };

  static bool isUnread(int fd);
  std::uint64_t forgetRead(int fd, Connection& connection) const;

  std::uint64_t most_bytes_, mostEach_bytes_;
  std::function<bool(int fd)> hasUnread_;
  std::map<std::string, Share> waiting_;  ///< by requester
  std::uint64_t all_bytes_ = 0;           ///< of all shares
};

}  // namespace tractiond::network
