#include "daemon/publish/frozen_peers.h"

#include "base/network/socket.h"

#include <linux/sockios.h>
#include <malloc.h>
#include <sys/ioctl.h>
#include <sys/stat.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <string>

namespace tractiond::publish {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr std::int64_t kPatience_ns = 5 * kSecond_ns;
constexpr std::int64_t kBetweenLines_ns = 60 * kSecond_ns;

/// Returns the number of file descriptors that the kernel's table of this process has room for: none has this number or
/// above.
int sizeOfDescriptorTable() {
  std::ifstream file("/proc/self/status");
  std::string key;
  int size = 0;
  while (file >> key && key != "FDSize:") file.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
  file >> size;
  return size;
}

}  // namespace

/// Looks at one descriptor. Returns whether it was a connection that nobody reads, which is ended then.
bool FrozenPeers::lookAt(int fd, std::int64_t now_ns) {
  struct stat status {};
  int waiting_bytes = 0;
  const auto known = connections_.find(fd);
  if (fstat(fd, &status) != 0 || !S_ISSOCK(status.st_mode) || ioctl(fd, SIOCOUTQ, &waiting_bytes) != 0 ||
      waiting_bytes == 0) {
    if (known != connections_.end()) connections_.erase(known);
    return false;
  }
  if (known == connections_.end() || known->second.socket != status.st_ino ||
      known->second.waiting_bytes != waiting_bytes) {
    connections_[fd] = {status.st_ino, waiting_bytes, now_ns};
    return false;
  }
  if (now_ns - known->second.since_ns < kPatience_ns || !network::cutOff(fd, bound_)) return false;
  connections_.erase(known);
  return true;
}

void FrozenPeers::look(std::int64_t now_ns) {
  if (next_ >= end_) {  // a round is done
    if (now_ns - began_ns_ < kSecond_ns) return;
    began_ns_ = now_ns;
    next_ = frozen_ = 0;
    end_ = sizeOfDescriptorTable();
  }
  for (const int end = std::min(end_, next_ + most_); next_ < end; ++next_) frozen_ += lookAt(next_, now_ns) ? 1 : 0;
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
