#include "base/network/inflow_limit.h"

#include "base/network/connection_limit.h"
#include "base/network/ends.h"

#include <malloc.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstddef>
#include <limits>
#include <map>
#include <mutex>
#include <span>
#include <utility>

namespace tractiond::network::inflow {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000, kBetweenLines_ns = 60 * kSecond_ns;

/// Account of a peer's frames that ZeroMQ may hold.
struct Connection {
  std::uint64_t cookie = 0;  ///< SO_COOKIE: identifies the connection, as the number of its descriptor may be reused
  bool watched = false, cut = false;
  Charge charge = Charge::kRequests;
  FrameMeter meter;
  std::uint64_t sent = 0;                       ///< frames
  std::uint64_t frames = 0, charged_bytes = 0;  ///< held by ZeroMQ
};

struct Account {
  std::multimap<std::string, Charge> endpoints;  ///< by localEnd()
  std::uint64_t charged_bytes = 0;               ///< of all connections
  std::size_t highest = 0;                       ///< largest descriptor that was seen
  std::string last;                              ///< connection that was ended, and why
};

// NOLINTBEGIN(*-avoid-non-const-global-variables): recv() is called without an object of ours
std::mutex mutex;  // guards the two below
Account account;
constinit std::array<Connection, connections::kMostDescriptors>
    records{};  // by file descriptor; unused pages cost nothing
std::atomic<std::size_t> watchedEndpoints{0};
std::atomic<std::uint64_t> endedCount{0};
std::atomic<bool> seesReads{false}, isBypassed{false};
// Charges of connections that have ended, by Charge: their messages wait until they are taken.
std::array<std::atomic<std::uint64_t>, 2> left_bytes{};
// NOLINTEND(*-avoid-non-const-global-variables)

std::atomic<std::uint64_t>& leftOf(Charge charge) {
  return left_bytes[static_cast<std::size_t>(charge)];
}

/// Removes the charge of a connection from its record; its messages may still wait.
void writeOff(Connection& one) {
  account.charged_bytes -= one.charged_bytes;
  leftOf(one.charge) += std::exchange(one.charged_bytes, 0);
  one.frames = 0;
}

void end(Connection& one, int fd, const std::string& why) {
  const std::string peer = peerOf(fd);
  account.last = (peer.empty() ? "a peer that has gone" : peer) + ": it " + why;
  ++endedCount;
  one.cut = true;
  writeOff(one);
}

/// Ends the connection with the largest charge if all of them together exceed the limit.
void endLargest() {
  Connection* largest = nullptr;
  for (std::size_t fd = 0; fd <= account.highest; ++fd) {
    Connection& one = records[fd];
    if (one.charged_bytes == 0) continue;
    if (cookieOf(static_cast<int>(fd)) != one.cookie) {  // ended without being reported
      writeOff(one);
    } else if (largest == nullptr || one.charged_bytes > largest->charged_bytes) {
      largest = &one;
    }
  }
  if (largest == nullptr || account.charged_bytes <= kMostTogether_bytes) return;
  const int fd = static_cast<int>(largest - records.data());
  end(*largest, fd, "held most of the " + std::to_string(kMostTogether_bytes >> 10) + " KiB of all");
  shutDown(fd);
}

void startAnew(Connection& one) {
  writeOff(one);
  one = Connection();
}

/// Returns the record of a connection; a new one if its descriptor was used by another connection before.
Connection& find(int fd) {
  Connection& one = records[static_cast<std::size_t>(fd)];
  const std::uint64_t cookie = cookieOf(fd);
  if (one.cookie == cookie) return one;
  startAnew(one);
  one.cookie = cookie;
  account.highest = std::max(account.highest, static_cast<std::size_t>(fd));
  const auto at = account.endpoints.find(localEnd(fd));
  if (at == account.endpoints.end()) return one;
  one.watched = true;
  one.charge = at->second;
  return one;
}

/// Forgets all connections and their charges, as their sockets are being closed.
void clear() {
  std::fill_n(records.begin(), account.highest + 1, Connection{});
  account.charged_bytes = 0;
  account.highest = 0;
  for (auto& left : left_bytes) left = 0;
}

bool isRecorded(int fd) {
  return fd >= 0 && static_cast<std::size_t>(fd) < records.size();
}

bool isWatched(int fd) {
  const std::lock_guard lock(mutex);
  return account.endpoints.contains(localEnd(fd));
}

/// Counts the bytes that were read. Returns whether they may be passed to ZeroMQ.
bool allows(int fd, std::span<const std::uint8_t> bytes) {
  const std::lock_guard lock(mutex);
  Connection& one = find(fd);
  if (!one.watched) return true;
  seesReads.store(true, std::memory_order_relaxed);  // a fact that does not change: it orders nothing
  if (one.cut) return false;
  const FrameMeter::Reading reading = one.meter.read(bytes, one.charge);
  one.frames += reading.frames;
  one.sent += reading.frames;
  one.charged_bytes += reading.cost_bytes;
  account.charged_bytes += reading.cost_bytes;
  if (reading.isOld) {
    end(one, fd, "speaks a protocol older than ZMTP 3.0 (libzmq 4.0), or none of ZeroMQ");
  } else if (one.charged_bytes > kMost_bytes) {
    end(one, fd,
        "sent parts of a message that does not end, or more than is read of it: above " +
            std::to_string(kMost_bytes >> 10) + " KiB");
  } else if (reading.frames > 0 && leftOf(one.charge) > kMostTogether_bytes) {
    end(one, fd, "came while too much waits of connections that have ended");
  } else if (account.charged_bytes > kMostTogether_bytes) {
    endLargest();
  }
  return !one.cut;
}

void forget(int fd) {
  const std::lock_guard lock(mutex);
  startAnew(records[static_cast<std::size_t>(fd)]);
}

/// All reads of this program by recv(), ZeroMQ's among them, as the linker takes a program's own functions before those
/// of libraries.
extern "C" __attribute__((visibility("default"), used)) ssize_t
receiveWithinLimits(int fd, void* buffer, std::size_t size, int flags) __asm__("recv");
extern "C" ssize_t receiveWithinLimits(int fd, void* buffer, std::size_t size, int flags) {
  const ssize_t count = network::receive(fd, buffer, size, flags);
  if (watchedEndpoints.load(std::memory_order_relaxed) == 0 || (flags & MSG_PEEK) != 0 || size == 0) return count;
  const int error = errno;
  if (static_cast<std::size_t>(fd) >= records.size()) return count <= 0 || !isWatched(fd) ? count : 0;
  const bool over = count == 0 || (count < 0 && error != EAGAIN && error != EINTR);
  if (over) forget(fd);
  const bool mayHave =
      count <= 0 || allows(fd, {static_cast<const std::uint8_t*>(buffer), static_cast<std::size_t>(count)});
  errno = error;
  return mayHave ? count : 0;  // as if the peer had ended the connection
}

}  // namespace

void watch(const std::string& endpoint, Charge charge) {
  const std::lock_guard lock(mutex);
  account.endpoints.emplace(localEndOf(endpoint), charge);
  watchedEndpoints = account.endpoints.size();
}

void unwatch(const std::vector<std::string>& endpoints) {
  const std::lock_guard lock(mutex);
  for (const std::string& endpoint : endpoints) {
    const auto one = account.endpoints.find(localEndOf(endpoint));
    if (one != account.endpoints.end()) account.endpoints.erase(one);
  }
  watchedEndpoints = account.endpoints.size();
  if (account.endpoints.empty()) clear();
}

void release(int fd, std::size_t parts) {
  if (!isRecorded(fd)) return;
  if (!seesReads.load(std::memory_order_relaxed) || !connections::seesAccepts())
    isBypassed.store(true, std::memory_order_relaxed);
  const std::lock_guard lock(mutex);
  Connection& one = records[static_cast<std::size_t>(fd)];
  if (one.frames == 0) return;
  // The sizes of encrypted frames are not known: they count as frames of average size.
  const std::uint64_t frames = std::min<std::uint64_t>(parts, one.frames);
  const std::uint64_t cost_bytes = one.charged_bytes * frames / one.frames;
  one.frames -= frames;
  one.charged_bytes -= cost_bytes;
  account.charged_bytes -= cost_bytes;
}

std::uint64_t sentOver(int fd) {
  if (!isRecorded(fd) || !seesReads.load(std::memory_order_relaxed)) return std::numeric_limits<std::uint64_t>::max();
  const std::lock_guard lock(mutex);
  return records[static_cast<std::size_t>(fd)].sent;
}

void releaseEnded(Charge charge) {
  leftOf(charge).store(0, std::memory_order_relaxed);  // an estimate: orders no other memory access
}

std::uint64_t ended() {
  return endedCount;
}

std::string Report::nextLine(std::int64_t now_ns) {
  if (now_ns - called_ns_ < kSecond_ns) return "";
  called_ns_ = now_ns;
  if (isBypassed.load(std::memory_order_relaxed) && !std::exchange(saidBypassed_, true)) {
    return "messages come over connections that were not seen to be accepted and read: this libzmq uses other calls "
           "than "
           "accept4() and recv(), so peers can fill the memory and take all file descriptors";
  }
  const std::uint64_t count = ended();
  if (count != std::exchange(seen_, count)) trims_ = 3;
  if (trims_ > 0) {
    --trims_;
    malloc_trim(0);
  }
  if (count == told_ || (told_ns_ != 0 && now_ns - told_ns_ < kBetweenLines_ns)) return "";
  told_ns_ = now_ns;
  const std::uint64_t news = count - std::exchange(told_, count);
  const std::lock_guard lock(mutex);
  return std::to_string(news) + " connections were closed; the last was " + account.last;
}

}  // namespace tractiond::network::inflow
