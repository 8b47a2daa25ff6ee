#include "base/network/subscriptions.h"

#include "base/network/socket.h"

#include <string_view>

namespace tractiond::network {

void Subscriptions::note(zmq::message_t& message) {
  const std::string_view text = message.to_string_view();
  const bool isSubscription = text.starts_with('\1');
  if (!isSubscription && !text.starts_with('\0')) return;
  auto found = topics_.find(text.substr(1));
  if (found == topics_.end()) {
    if (!isSubscription) return;
    found = topics_.emplace(text.substr(1), Topic()).first;
  }
  Topic& topic = found->second;
  const void* const connection = connectionOf(message);
  if (isSubscription) {
    add(topic, connection, message);
  } else if (connection != nullptr) {
    topic.connections.erase(connection);
  } else {
    ++topic.ended;
  }
  if (topic.connections.size() <= topic.ended) topics_.erase(found);
}

std::size_t Subscriptions::kept() const {
  std::size_t sum = 0;
  for (const auto& [name, topic] : topics_) sum += topic.connections.size();
  return sum;
}

void Subscriptions::add(Topic& topic, const void* connection, zmq::message_t& subscription) {
  const auto [added, isNew] = topic.connections.try_emplace(connection);
  if (!isNew) return;
  const int fd = added->second.fd = sourceOf(subscription);
  (void)zmq_msg_copy(added->second.subscription.handle(), subscription.handle());  // needs no memory: bytes are shared
  // Earlier ones with its descriptor have ended: without them the number of connections is bounded.
  std::erase_if(topic.connections, [&](const auto& one) {
    if (one.first == connection || one.second.fd != fd || topic.ended == 0) return false;
    --topic.ended;
    return true;
  });
}

}  // namespace tractiond::network
