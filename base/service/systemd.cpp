#include "base/service/systemd.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>

namespace tractiond::systemd {

bool notify(const std::string& text) {
  const char* const path = std::getenv("NOTIFY_SOCKET");
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path == nullptr || (*path != '/' && *path != '@')) return true;  // nobody listens
  const std::size_t length = std::strlen(path);
  if (length >= sizeof address.sun_path) return true;
  std::memcpy(address.sun_path, path, length);
  if (*path == '@') address.sun_path[0] = '\0';  // abstract
  const int descriptor = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (descriptor < 0) return false;
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + length);
  const auto sent = sendto(descriptor, text.data(), text.size(), MSG_DONTWAIT | MSG_NOSIGNAL,
                           reinterpret_cast<const sockaddr*>(&address), size);
  close(descriptor);
  return sent >= 0;
}

std::chrono::microseconds watchdog() {
  std::uint64_t deadline_us = 0;
  return std::chrono::microseconds(sd_watchdog_enabled(0, &deadline_us) > 0 ? deadline_us : 0);
}

}  // namespace tractiond::systemd
