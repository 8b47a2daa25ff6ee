#include "base/network/subscriptions.h"

#include "base/network/ends.h"
#include "base/network/inflow_limit.h"
#include "base/network/socket.h"

#include <algorithm>

namespace tractiond::network {
namespace {

/// Topics above which those are forgotten that wait for the end of a connection alone: one that has subscribed
/// repeatedly before it ended is told once.
constexpr std::size_t kMost = 1000;

}  // namespace

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
  const int fd = sourceOf(message);
  const std::uint64_t cookie = fd < 0 ? 0 : cookieOf(fd);
  const bool mayBeWrong = inflow::originOf(fd).left > 0;
  const auto known = topic.connections.find(fd);
  if (fd < 0) {
    ++topic.ended;
    removeEnded(topic);
  } else if (!isSubscription) {
    if (known != topic.connections.end()) topic.connections.erase(known);
  } else if (known == topic.connections.end()) {
    topic.connections.emplace(fd, Connection{cookie, mayBeWrong});
  } else if ((known->second.cookie != cookie || (known->second.mayBeWrong && cookie != 0)) &&
             topic.ended > std::ranges::count_if(topic.connections,
                                                 [fd](const auto& one) { return one.first != fd && hasEnded(one); })) {
    known->second = {cookie, mayBeWrong};  // the end of the one before has been told, as more were than of others
    --topic.ended;
  }  // else it is repeated, by the connection that has ended if the descriptor is another one's: its end is told later
  if (topic.connections.empty() && topic.ended >= 0) topics_.erase(found);
}

bool Subscriptions::hasEnded(const std::pair<const int, Connection>& one) {
  return one.second.cookie == 0 || cookieOf(one.first) != one.second.cookie;
}

void Subscriptions::removeEnded(Topic& topic) {
  topic.ended -= static_cast<int>(std::erase_if(topic.connections, [](const auto& one) {
    if (!hasEnded(one)) return false;
    const bool mayHaveCancelled = inflow::originOf(one.first).left > 0;  // its end is then not told
    return !mayHaveCancelled;
  }));
}

void Subscriptions::removeEnded() {
  for (auto& [name, topic] : topics_) removeEnded(topic);
  const bool areMany = topics_.size() > kMost;
  std::erase_if(topics_, [areMany](const auto& one) {
    return one.second.connections.empty() && (one.second.ended >= 0 || areMany);
  });
}

bool Subscriptions::empty() const {
  return std::ranges::all_of(topics_, [](const auto& one) {
    return static_cast<int>(one.second.connections.size()) <= std::max(one.second.ended, 0);
  });
}

}  // namespace tractiond::network
