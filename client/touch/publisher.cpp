#include "client/touch/publisher.h"

#include "base/network/socket.h"
#include "proto/traction/v1/endpoints.h"

#include <zmq.hpp>

#include <array>
#include <cerrno>
#include <cstdio>
#include <string_view>
#include <utility>

namespace traction::contacts {
namespace {

/// Messages that may wait for one slow subscriber; further ones are lost to it. Four seconds at 60 frames/s.
constexpr int kHighWaterMark = 256;
/// A subscription is a topic's beginning; nothing longer comes from an honest peer [bytes].
constexpr std::int64_t kLargestSubscription = 64;

}  // namespace

struct Publisher::Impl {
  ~Impl() { tractiond::network::release(bound); }

  void send(const auto& message, std::string_view kind) {
    const std::string topic = topicOf(message.header().sensor(), kind);
    message.SerializeToString(&bytes);
    std::array<char, 40> time{};
    const int length = std::snprintf(time.data(), time.size(), "%.9f", message.timestamp());
    put(topic.data(), topic.size(), ZMQ_SNDMORE);
    put(bytes.data(), bytes.size(), ZMQ_SNDMORE);
    put(time.data(), static_cast<std::size_t>(length), 0);
  }

  /// Drops the message if ZeroMQ has no memory for it.
  void put(const void* part, std::size_t size, int flags) {
    while (zmq_send(socket.handle(), part, size, flags) < 0 && zmq_errno() == EINTR) {
    }
  }

  zmq::context_t context{1};
  zmq::socket_t socket{context, zmq::socket_type::pub};
  std::vector<std::string> bound;
  std::string bytes;
};

Publisher::Publisher(std::unique_ptr<Impl> impl)
    : impl_(std::move(impl)) {}

Publisher::~Publisher() = default;

tl::expected<std::unique_ptr<Publisher>, tractiond::Error>
Publisher::open(const std::vector<std::string>& endpoints) try {
  auto impl = std::make_unique<Impl>();
  tractiond::network::guard(impl->socket, kHighWaterMark, kLargestSubscription);
  auto bound = tractiond::network::bind(impl->socket, endpoints);
  if (!bound) return tl::unexpected(bound.error());
  impl->bound = *std::move(bound);
  return std::unique_ptr<Publisher>(new Publisher(std::move(impl)));
} catch (const zmq::error_t& error) {
  return tl::unexpected(tractiond::Error{EX_OSERR, std::string("ZeroMQ cannot start: ") + error.what(), "", ""});
}

void Publisher::send(const v1::Contacts& contacts) {
  impl_->send(contacts, "contacts");
}

void Publisher::send(const v1::Grasp& grasp) {
  impl_->send(grasp, "grasp");
}

const std::vector<std::string>& Publisher::endpoints() const {
  return impl_->bound;
}

}  // namespace traction::contacts
