// The bus between its peers and the daemon: messages on their way, queues and their limits, connections that end.
#include "tests/simulation/bus_parts.h"

#include <algorithm>
#include <array>
#include <utility>

namespace tractiond::simulation {
namespace {

constexpr std::size_t kKernel_bytes = 200'000;  // of a connection, that its peer has not read

std::size_t& held() {
  static std::size_t bytes = 0;
  return bytes;
}

}  // namespace

Content::Content(std::size_t size)
    : own_(std::make_unique_for_overwrite<char[]>(size))
    , data_(own_.get())
    , size_(size) {
  held() += size_;
}

Content::Content(std::string_view bytes)
    : Content(bytes.size()) {
  std::ranges::copy(bytes, data_);
}

Content::Content(void* data, std::size_t size, zmq_free_fn* free, void* hint)
    : data_(static_cast<char*>(data))
    , size_(size)
    , free_(free)
    , hint_(hint) {
  held() += size_;
}

Content::~Content() {
  held() -= size_;
  if (free_ != nullptr) free_(data_, hint_);
}

std::size_t Content::held_bytes() {
  return held();
}

Bus*& bus() {
  static Bus* one = nullptr;
  return one;
}

Bus::Bus()
    : turned_ns_(now()) {}

Bus::~Bus() = default;

Bus::Connection* Bus::find(int id) {
  const auto one = connections_.find(id);
  return one == connections_.end() ? nullptr : &one->second;
}

const Bus::Connection* Bus::find(int id) const {
  const auto one = connections_.find(id);
  return one == connections_.end() ? nullptr : &one->second;
}

int Bus::connect(int port, Peer& peer, const std::string& address, std::int64_t reads_bytesPerMs) {
  const auto listens = std::ranges::find_if(sockets_, [port](const auto& one) { return one->port == port; });
  if (listens == sockets_.end()) return -1;
  Socket& socket = **listens;
  const int id = ++last_;
  Connection& one = connections_
                        .emplace(id, Connection{.socket = &socket,
                                                .peer = &peer,
                                                .address = std::make_shared<std::string>(address),
                                                .reads_bytesPerMs = reads_bytesPerMs,
                                                .id = id})
                        .first->second;
  if (reads_bytesPerMs > 0) slow_.insert(id);
  socket.connections.push_back(&one);
  if (socket.type == ZMQ_ROUTER) {
    const auto number = static_cast<std::uint32_t>(++socket.routesSoFar);
    one.route.resize(5);
    for (std::size_t i = 1; i < 5; ++i) one.route[i] = static_cast<char>(number >> (32 - 8 * i));
    socket.routes[one.route] = &one;
    one.inbox = std::make_shared<Inbox>();
    socket.inboxes.push_back(one.inbox);
  }
  return id;
}

void Bus::send(int id, std::span<const std::string> parts) {
  Connection* const one = find(id);
  if (one == nullptr || one->hasEnded) return;
  const std::int64_t largest = one->socket->largest;
  const bool isTooLarge = largest >= 0 && std::ranges::any_of(parts, [largest](const std::string& part) {
                            return std::cmp_greater(part.size(), largest);
                          });
  isTooLarge ? end(*one) : arrive(*one, parts);
}

void Bus::arrive(Connection& one, std::span<const std::string> parts) {
  Socket& socket = *one.socket;
  Message message;
  const auto add = [&](std::string_view bytes, bool more) {
    message.push_back({std::make_shared<Content>(bytes), more, one.address});
  };
  if (socket.type == ZMQ_ROUTER) add(one.route, true);
  for (const std::string& part : parts) add(part, &part != &parts.back());
  if (socket.type == ZMQ_ROUTER) return one.inbox->messages.push_back(std::move(message));
  const std::string& text = parts[0];
  const auto topic = std::ranges::find(one.subscriptions, text.substr(1));
  const bool isKnown = topic != one.subscriptions.end();
  if (text.starts_with('\0') && isKnown) {
    one.subscriptions.erase(topic);
    cancel(socket, text.substr(1));
  }
  if (!text.starts_with('\1')) return;
  const bool isFirst = std::ranges::none_of(socket.connections, [&](const Connection* other) {
    return std::ranges::find(other->subscriptions, text.substr(1)) != other->subscriptions.end();
  });
  if (!isKnown) one.subscriptions.push_back(text.substr(1));
  if (socket.type == ZMQ_XPUB && (isFirst || socket.isVerbose)) socket.subscriptions.push_back(std::move(message));
}

/// Tells the program that a subscription has ended, if it was the last one to its topic.
void Bus::cancel(Socket& socket, const std::string& topic) {
  const bool isWanted = std::ranges::any_of(socket.connections, [&](const Connection* other) {
    return std::ranges::find(other->subscriptions, topic) != other->subscriptions.end();
  });
  if (socket.type == ZMQ_XPUB && !isWanted)
    socket.subscriptions.push_back({{std::make_shared<Content>(std::string(1, '\0') + topic)}});
}

/// libzmq notices that the connection has ended, and forgets what waits for its peer.
void Bus::end(Connection& one) {
  if (std::exchange(one.hasEnded, true)) return;
  slow_.erase(one.id);
  Socket& socket = *one.socket;
  one.queue.clear();
  one.kernel.clear();
  one.kernel_bytes = 0;
  std::erase(socket.connections, &one);
  socket.routes.erase(one.route);
  if (one.inbox) one.inbox->hasEnded = true;
  for (const std::string& topic : one.subscriptions) cancel(socket, topic);
}

void Bus::disconnect(int id) {
  Connection* const one = find(id);
  if (one == nullptr) return;
  end(*one);
  connections_.erase(id);
}

bool Bus::hasEnded(int id) const {
  const Connection* const one = find(id);
  return one == nullptr || one->hasEnded;
}

bool Bus::hasSubscriptions() const {
  return std::ranges::any_of(sockets_, [](const auto& socket) { return !socket->subscriptions.empty(); });
}

std::size_t Bus::waitingRequests() const {
  std::size_t count = 0;
  for (const auto& socket : sockets_) {
    for (const auto& inbox : socket->inboxes) count += inbox->messages.size();
  }
  return count;
}

void Bus::turn() {
  const std::int64_t passed_ns = now() - std::exchange(turned_ns_, now());
  if (passed_ns == 0) return;
  for (const int id : slow_) read(*find(id), passed_ns);
}

void Bus::read(Connection& one, std::int64_t passed_ns) {
  one.passed_ns += passed_ns;
  std::int64_t can_bytes = one.passed_ns * one.reads_bytesPerMs / kMs;
  one.passed_ns -= can_bytes * kMs / one.reads_bytesPerMs;
  while (!one.kernel.empty() && can_bytes > 0) {
    const auto some =
        std::min<std::size_t>(static_cast<std::size_t>(can_bytes), one.kernel[0].bytes - one.isRead_bytes);
    can_bytes -= static_cast<std::int64_t>(some);
    one.isRead_bytes += some;
    one.kernel_bytes -= some;
    if (one.isRead_bytes < one.kernel[0].bytes) break;
    one.isRead_bytes = 0;
    const Connection::Written written = std::move(one.kernel.front());
    one.kernel.pop_front();
    const std::vector<std::string_view> parts(written.parts.begin(), written.parts.end());
    one.peer->heed(parts, written.number);
    fillKernel(one);
  }
}

void Bus::fillKernel(Connection& one) {
  while (!one.queue.empty() && one.kernel_bytes < kKernel_bytes) {
    Connection::Written written{{}, 0, one.queue[0].number};
    for (const Part& part : one.queue[0].message) {
      written.parts.emplace_back(part.content->view());
      written.bytes += part.content->size() + 2;
    }
    one.kernel_bytes += written.bytes;
    one.kernel.push_back(std::move(written));
    one.queue.pop_front();
  }
}

/// A full queue loses the message.
void Bus::offer(Connection& one, const Message& message, std::uint64_t number) {
  if (one.reads_bytesPerMs == kAtOnce) {
    std::array<std::string_view, 4> parts;
    for (std::size_t i = 0; i < message.size(); ++i) parts.at(i) = message[i].content->view();
    return one.peer->heed({parts.data(), message.size()}, number);
  }
  if (one.socket->conflates) one.queue.clear();
  if (one.queue.size() < one.socket->highWaterMark) one.queue.push_back({message, number});
  fillKernel(one);
}

void Bus::dispatch(Socket& socket, Message message) {
  const std::uint64_t number = ++messages_;
  if (socket.type == ZMQ_ROUTER) {
    const auto route = socket.routes.find(std::string(message[0].content->view()));
    if (route == socket.routes.end()) return;
    message.erase(message.begin());
    return offer(*route->second, message, number);
  }
  const std::string_view topic = message[0].content->view();
  for (Connection* const one : socket.connections) {
    if (std::ranges::any_of(one->subscriptions, [&](const std::string& wanted) { return topic.starts_with(wanted); }))
      offer(*one, message, number);
  }
}

}  // namespace tractiond::simulation
