#include "client/cli/sockets.h"

#include "base/network/socket_file.h"

#include <zmq.hpp>

#include <array>
#include <cstdio>
#include <map>

namespace traction::client {

struct Repeater::Impl {
  struct Kept {
    std::string bytes, time;
  };

  void sendParts(const std::string& topic, const Kept& kept) {
    for (const std::string* part : {&topic, &kept.bytes, &kept.time}) {
      const int flags = ZMQ_DONTWAIT | (part == &kept.time ? 0 : ZMQ_SNDMORE);
      if (zmq_send(socket.handle(), part->data(), part->size(), flags) < 0)
        return;  // interrupted by a signal: the program is about to end
    }
  }

  zmq::context_t context{1};
  zmq::socket_t socket{context, zmq::socket_type::xpub};
  std::map<std::string, Kept> descriptions;  ///< topic -> the last
  bool isHeard = false;
};

Repeater::Repeater(const std::string& endpoint)
    : impl_(std::make_unique<Impl>()) {
  impl_->socket.set(zmq::sockopt::linger, 1000);
  impl_->socket.set(zmq::sockopt::xpub_verbose, true);  // reports later subscribers, too
  if (const auto error = tractiond::network::checkEndpoint(endpoint)) {
    throw Error(ErrorCode::kBadEndpoint, error->what);
  }
  try {
    impl_->socket.bind(endpoint);
  } catch (const zmq::error_t& error) {
    throw Error(ErrorCode::kBadEndpoint, endpoint + ": " + error.what());
  }
}

Repeater::~Repeater() = default;

std::string Repeater::endpoint() const {
  return impl_->socket.get(zmq::sockopt::last_endpoint);
}

bool Repeater::isHeard() const {
  return impl_->isHeard;
}

void Repeater::listen(std::chrono::milliseconds time) {
  zmq_pollitem_t item{impl_->socket.handle(), 0, ZMQ_POLLIN, 0};
  if (zmq_poll(&item, 1, static_cast<long>(time.count())) <= 0) return;
  for (zmq::message_t said; zmq_msg_recv(said.handle(), impl_->socket.handle(), ZMQ_DONTWAIT) >= 0;) {
    if (said.empty() || *said.data<char>() != 1) continue;  // 1: subscribes
    impl_->isHeard = true;
    for (const auto& [topic, kept] : impl_->descriptions) impl_->sendParts(topic, kept);
  }
}

void Repeater::send(const Raw& raw, double time_s) {
  std::array<char, 40> time{};
  std::snprintf(time.data(), time.size(), "%.9f", time_s);
  const std::string topic(raw.topic);
  const Impl::Kept kept{std::string(raw.bytes), time.data()};
  if (topic.ends_with("/description/")) impl_->descriptions[topic] = kept;
  impl_->sendParts(topic, kept);
}

}  // namespace traction::client
