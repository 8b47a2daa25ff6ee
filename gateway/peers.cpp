#include "gateway/peers.h"

#include "base/network/socket.h"

#include <netdb.h>
#include <sys/socket.h>

#include <array>

namespace tractiond::gateway {

Peers::Connection Peers::otherEnd(int fd) {
  sockaddr_storage address{};
  socklen_t size = sizeof address;
  std::array<char, 64> host{}, port{};
  const auto* const plain = reinterpret_cast<const sockaddr*>(&address);
  if (getpeername(fd, reinterpret_cast<sockaddr*>(&address), &size) != 0 ||
      getnameinfo(plain, size, host.data(), host.size(), port.data(), port.size(), NI_NUMERICHOST | NI_NUMERICSERV) !=
          0) {
    return {};
  }
  return {host.data(), port.data(), nullptr};
}

void Peers::came(int fd, const std::vector<std::string>& bound) {
  forget(fd);  // in case the end of its predecessor was not reported
  Connection peer = otherEnd(fd);
  if (peer.address.empty()) return;
  const auto of = each_.find(peer.address);
  if (count() >= most_ || (of != each_.end() && of->second >= mostPerAddress_)) {
    ++refused_;
    lastRefused_ = peer.address;
    network::cutOff(fd, bound);
    return;
  }
  ++each_[peer.address];
  peer.bound = &bound;
  connections_.emplace(fd, std::move(peer));
}

void Peers::went(int fd, const std::vector<std::string>& bound) {
  const auto one = connections_.find(fd);
  if (one != connections_.end() && one->second.bound == &bound) forget(fd);
}

void Peers::forget(int fd) {
  const auto one = connections_.find(fd);
  if (one == connections_.end()) return;
  const auto of = each_.find(one->second.address);
  if (--of->second == 0) each_.erase(of);
  connections_.erase(one);
}

void Peers::removeEnded() {
  std::vector<int> gone;
  for (const auto& [fd, peer] : connections_) {
    const Connection now = otherEnd(fd);
    if (now.address != peer.address || now.port != peer.port) gone.push_back(fd);
  }
  for (const int fd : gone) forget(fd);
}

}  // namespace tractiond::gateway
