#include "daemon/publish/frozen_peers.h"

#include "daemon/publish/socket.h"

#include <dirent.h>
#include <linux/sockios.h>
#include <malloc.h>
#include <sys/ioctl.h>
#include <sys/stat.h>

#include <cstdlib>
#include <utility>

namespace tractiond::publish {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr std::int64_t kPatience_ns = 5 * kSecond_ns;
constexpr std::int64_t kBetweenLines_ns = 60 * kSecond_ns;

}  // namespace

void FrozenPeers::look(std::int64_t now_ns) {
  if (now_ns - looked_ns_ < kSecond_ns) return;
  looked_ns_ = now_ns;
  std::map<int, Connection> now;
  int frozen = 0;
  DIR* const folder = opendir("/proc/self/fd");
  while (const dirent* const entry = folder == nullptr ? nullptr : readdir(folder)) {
    const int fd = static_cast<int>(std::strtol(entry->d_name, nullptr, 10));
    struct stat status {};
    int waiting = 0;
    if (entry->d_name[0] == '.' || fstat(fd, &status) != 0 || !S_ISSOCK(status.st_mode) ||
        ioctl(fd, SIOCOUTQ, &waiting) != 0 || waiting == 0)
      continue;
    Connection one{status.st_ino, waiting, now_ns};
    const auto before = connections_.find(fd);
    if (before != connections_.end() && before->second.socket == one.socket && before->second.waiting_bytes == waiting)
      one.since_ns = before->second.since_ns;
    if (now_ns - one.since_ns >= kPatience_ns && cutOff(fd, bound_)) {
      ++frozen;
    } else {
      now.emplace(fd, one);
    }
  }
  if (folder != nullptr) closedir(folder);
  connections_ = std::move(now);
  if (frozen > 0) {
    trims_ = 3;
    if (told_ns_ == 0 || now_ns - told_ns_ >= kBetweenLines_ns) {
      told_ns_ = now_ns;
      told_(std::to_string(frozen) +
            " subscribers have read nothing for 5 s, and are cut off until they connect again");
    }
  }
  if (trims_ > 0) {
    --trims_;
    malloc_trim(0);
  }
}

}  // namespace tractiond::publish
