#include "base/network/ends.h"

#include <linux/sockios.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <fstream>
#include <limits>

namespace tractiond::network {

std::string localEnd(int fd) {
  sockaddr_storage address{};
  socklen_t size = sizeof address;
  if (getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size) != 0) return "";
  if (address.ss_family == AF_UNIX) {
    const char* const path = reinterpret_cast<const sockaddr_un&>(address).sun_path;
    const std::size_t length = size - offsetof(sockaddr_un, sun_path);
    const bool isAbstract = size > offsetof(sockaddr_un, sun_path) && path[0] == '\0';
    return "ipc://" + (isAbstract ? "@" + std::string(path + 1, length - 1) : std::string(path));
  }
  // The port is at the same place in both kinds of Internet address.
  if (address.ss_family != AF_INET && address.ss_family != AF_INET6) return "";
  return ":" + std::to_string(ntohs(reinterpret_cast<const sockaddr_in&>(address).sin_port));
}

std::string peerOf(int fd) {
  sockaddr_storage address{};
  socklen_t size = sizeof address;
  auto* const plain = reinterpret_cast<sockaddr*>(&address);
  if (getpeername(fd, plain, &size) != 0) return "";
  ucred user{};
  socklen_t userSize = sizeof user;
  if (address.ss_family == AF_UNIX && getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &user, &userSize) == 0)
    return "uid " + std::to_string(user.uid) + ", pid " + std::to_string(user.pid);
  std::array<char, 64> host{};
  const int failed = getnameinfo(plain, size, host.data(), host.size(), nullptr, 0, NI_NUMERICHOST);
  return failed == 0 ? host.data() : "a peer";
}

std::uint64_t cookieOf(int fd) {
  std::uint64_t cookie = 0;
  socklen_t size = sizeof cookie;
  return getsockopt(fd, SOL_SOCKET, SO_COOKIE, &cookie, &size) == 0 ? cookie : 0;
}

std::optional<Unread> unreadOf(int fd) {
  struct stat status {};
  int bytes = 0;
  if (fstat(fd, &status) != 0 || !S_ISSOCK(status.st_mode) || ioctl(fd, SIOCOUTQ, &bytes) != 0) return std::nullopt;
  return Unread{status.st_ino, bytes};
}

int endOfDescriptorTable() {
  std::ifstream file("/proc/self/status");
  std::string key;
  int size = 0;
  while (file >> key && key != "FDSize:") file.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
  file >> size;
  return size;
}

ssize_t receive(int fd, void* buffer, std::size_t size, int flags) {
  // Calls the kernel directly, as the thread sanitizer would report a call of the library from here as a write into
  // memory whose owner, ZeroMQ, it does not follow.
  return syscall(SYS_recvfrom, fd, buffer, size, flags, nullptr, nullptr);
}

bool shutDown(int fd) {
  return shutdown(fd, SHUT_RDWR) == 0;
}

}  // namespace tractiond::network
