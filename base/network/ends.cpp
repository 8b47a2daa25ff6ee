#include "base/network/ends.h"

#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <array>
#include <cstddef>

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

std::string localEndOf(const std::string& endpoint) {
  const std::size_t colon = endpoint.rfind(':');
  return endpoint.starts_with("ipc://") || colon == std::string::npos ? endpoint : endpoint.substr(colon);
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

}  // namespace tractiond::network
