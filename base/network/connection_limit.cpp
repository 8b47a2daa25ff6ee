#include "base/network/connection_limit.h"

#include "base/network/ends.h"

#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <map>
#include <utility>

namespace tractiond::network::connections {
namespace {

constexpr std::int64_t kBetweenLines_ns = 60'000'000'000;

// NOLINTBEGIN(*-avoid-non-const-global-variables): accept() is called without an object of ours
std::atomic<std::uint64_t> refusedCount{0};
std::atomic<bool> isCalled{false};
// NOLINTEND(*-avoid-non-const-global-variables)

/// Returns the first descriptor number that no connection may have.
std::size_t endOfDescriptors() {
  rlimit limit{};
  getrlimit(RLIMIT_NOFILE, &limit);
  const std::size_t allowed = std::min<std::size_t>(limit.rlim_cur, kMostDescriptors + kReserved);
  return allowed > kReserved ? allowed - kReserved : 0;
}

/// Accepts a connection, or closes it at once. The kernel gives the lowest number that is free, so the number itself
/// states how many descriptors are in use.
int acceptWithinLimits(int fd, sockaddr* address, socklen_t* size, int flags) {
  isCalled.store(true, std::memory_order_relaxed);  // never reset: orders no other memory access
  // Calls the kernel directly: the library's function would call this one again.
  const int accepted = static_cast<int>(syscall(SYS_accept4, fd, address, size, flags));
  if (accepted < 0) {
    // libzmq aborts at errors that it does not expect, and tries again after ECONNABORTED. The errors behind EPERM are
    // those of the network on the new connection (accept(2)).
    constexpr std::array kForeseen = {EMFILE,    ENFILE,       ENOBUFS, ENOMEM,      EPERM,  ENETDOWN, ENETUNREACH,
                                      EHOSTDOWN, EHOSTUNREACH, ENONET,  ENOPROTOOPT, EPROTO, ETIMEDOUT};
    if (std::ranges::find(kForeseen, errno) != kForeseen.end()) errno = ECONNABORTED;
    return accepted;
  }
  if (static_cast<std::size_t>(accepted) < endOfDescriptors()) return accepted;
  close(accepted);
  refusedCount.fetch_add(1, std::memory_order_relaxed);  // a count: orders no other memory access
  errno = ECONNABORTED;                                  // as if the peer had disconnected before it was accepted
  return -1;
}

extern "C" __attribute__((visibility("default"), used)) int acceptFour(int fd, sockaddr* address, socklen_t* size,
                                                                       int flags) __asm__("accept4");
extern "C" int acceptFour(int fd, sockaddr* address, socklen_t* size, int flags) {
  return acceptWithinLimits(fd, address, size, flags);
}

extern "C" __attribute__((visibility("default"), used)) int acceptThree(int fd, sockaddr* address,
                                                                        socklen_t* size) __asm__("accept");
extern "C" int acceptThree(int fd, sockaddr* address, socklen_t* size) {
  return acceptWithinLimits(fd, address, size, 0);
}

/// Describes which peer has most of the connections, and how many. Looks at `most` descriptors at most, evenly over
/// all, as each takes some 10 µs on a busy machine: with more descriptors the number is an estimate.
std::string largestPeer(std::size_t most) {
  std::map<std::string, std::size_t> each;
  const std::size_t end = endOfDescriptors();
  std::size_t stride = (end + most - 1) / most;
  if (stride % 2 == 0) ++stride;  // an odd stride sees both kinds of connection if they alternate
  for (std::size_t at = 0; at < end; at += stride) {
    const int fd = static_cast<int>(at);
    if (const std::string peer = localEnd(fd).empty() ? "" : peerOf(fd); !peer.empty()) ++each[peer];
  }
  const auto largest = std::ranges::max_element(each, {}, [](const auto& one) { return one.second; });
  if (largest == each.end()) return "no peer is connected now";
  return largest->first + " has " + (stride > 1 ? "about " : "") + std::to_string(largest->second * stride) +
         " connections";
}

}  // namespace

std::uint64_t refused() {
  return refusedCount.load(std::memory_order_relaxed);
}

bool seesAccepts() {
  return isCalled.load(std::memory_order_relaxed);
}

std::string Report::nextLine(std::int64_t now_ns) {
  const std::uint64_t count = refused();
  if (count == told_ || (told_ns_ != 0 && now_ns - told_ns_ < kBetweenLines_ns)) return "";
  told_ns_ = now_ns;
  const std::uint64_t news = count - std::exchange(told_, count);
  return std::to_string(news) + " connections were refused: " + std::to_string(endOfDescriptors()) +
         " file descriptors are in use, and the other " + std::to_string(kReserved) + " are kept for the program; " +
         largestPeer(mostExamined_);
}

}  // namespace tractiond::network::connections
