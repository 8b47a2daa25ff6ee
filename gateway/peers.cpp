#include "gateway/peers.h"

#include "base/network/ends.h"
#include "base/network/socket.h"

#include <utility>

namespace tractiond::gateway {

void Peers::came(int fd, const std::vector<std::string>& bound) {
  std::string address = network::peerOf(fd);
  if (address.empty() || !network::isConnectionTo(fd, bound)) return;
  forget(fd);  // in case the end of its predecessor was not reported
  const auto of = each_.find(address);
  if (count() >= most_ || (of != each_.end() && of->second >= mostPerAddress_)) {
    ++refused_;
    lastRefused_ = std::move(address);
    network::cutOff(fd, bound);
    return;
  }
  ++each_[address];
  connections_.emplace(fd, Connection{std::move(address), network::cookieOf(fd), &bound});
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
    if (network::cookieOf(fd) != peer.cookie || network::peerOf(fd).empty()) gone.push_back(fd);
  }
  for (const int fd : gone) forget(fd);
}

}  // namespace tractiond::gateway
