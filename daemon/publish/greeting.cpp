#include "daemon/publish/greeting.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string_view>
#include <utility>

namespace tractiond::publish {

Greeting::Greeting(const std::string& endpoint) {
  constexpr std::string_view kLocal = "ipc://";
  if (endpoint.starts_with(kLocal)) path_ = endpoint.substr(kLocal.size());
}

Greeting::Greeting(Greeting&& other) noexcept
    : path_(std::move(other.path_))
    , socket_(std::exchange(other.socket_, -1)) {}

Greeting::~Greeting() {
  if (socket_ >= 0) close(socket_);
}

bool Greeting::poll() {
  if (socket_ < 0) return connect(), true;
  char first = 0;
  if (recv(socket_, &first, 1, MSG_DONTWAIT) < 0 && (errno == EAGAIN || errno == EINTR)) return false;
  close(std::exchange(socket_, -1));
  connect();
  return true;
}

void Greeting::connect() {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path_.empty() || path_.size() >= sizeof address.sun_path) return;
  std::memcpy(address.sun_path, path_.data(), path_.size());
  socket_ = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (socket_ >= 0 && ::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    close(std::exchange(socket_, -1));  // a crowd waits to be let in: tried again
}

}  // namespace tractiond::publish
