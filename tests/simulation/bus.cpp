// The bus between its peers and the daemon: messages on their way, queues and their limits, connections that end.
#include "tests/simulation/bus_parts.h"

#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <utility>

namespace tractiond::simulation {
namespace {

constexpr std::size_t kKernel_bytes = 200'000;  // of a connection, that its peer has not read
constexpr std::size_t kRead_bytes = 8192;       // that libzmq reads at once
constexpr std::size_t kGreeting = 64;

std::size_t& held() {
  static std::size_t bytes = 0;
  return bytes;
}

/// Appends a frame as ZMTP 3 has it (RFC 23).
void encode(std::string& wire, std::string_view body, bool more) {
  const bool isLong = body.size() > 255;
  wire += static_cast<char>((more ? 1 : 0) | (isLong ? 2 : 0));
  for (int shift = isLong ? 56 : 0; shift >= 0; shift -= 8) wire += static_cast<char>(body.size() >> shift & 255);
  wire += body;
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
    : turned_ns_(now()) {
  (void)::accept(-1, nullptr, nullptr);  // connections are seen to be accepted (connection_limit.h)
}

Bus::~Bus() = default;

Bus::Connection* Bus::find(int fd) {
  const auto one = connections_.find(fd);
  return one == connections_.end() ? nullptr : &one->second;
}

const Bus::Connection* Bus::find(int fd) const {
  const auto one = connections_.find(fd);
  return one == connections_.end() ? nullptr : &one->second;
}

int Bus::connect(int port, Peer& peer, const std::string& address, std::int64_t reads_bytesPerMs,
                 const Credentials& credentials) {
  const auto listens = std::ranges::find_if(sockets_, [port](const auto& one) { return one->port == port; });
  if (listens == sockets_.end()) return -1;
  Socket& socket = **listens;
  const int fd = free_.empty() ? next_++ : free_.extract(free_.begin()).value();
  Connection& one = connections_
                        .emplace(fd, Connection{.socket = &socket,
                                                .peer = &peer,
                                                .address = std::make_shared<std::string>(address),
                                                .reads_bytesPerMs = reads_bytesPerMs,
                                                .fd = fd,
                                                .cookie = ++cookies_})
                        .first->second;
  if (reads_bytesPerMs > 0) slow_.insert(fd);
  std::string greeting(kGreeting, '\0');
  greeting[0] = '\xff';
  greeting[9] = '\x7f';
  greeting[10] = 3;
  one.wire = greeting + std::string("\4\6\5READY", 8);
  greet(one, credentials);
  return fd;
}

void Bus::send(int fd, std::span<const std::string> parts, bool isWhole) {
  Connection* const one = find(fd);
  if (one == nullptr || one->hasEnded) return;
  if (!one->isAdmitted) return one->early.push_back({{parts.begin(), parts.end()}, isWhole});
  if (!reach(*one, parts, isWhole)) {
    ++cutOff_;
    end(*one);
  }
  endShut();
  if (!one->hasEnded && isWhole) arrive(*one, parts);
}

/// Lets libzmq read what the peer sends, by the daemon's own recv(). Returns false if the connection ends.
bool Bus::reach(Connection& one, std::span<const std::string> parts, bool isWhole) {
  for (const std::string& part : parts) {
    encode(one.wire, part, !isWhole || &part != &parts.back());
    if (one.socket->largest >= 0 && std::cmp_greater(part.size(), one.socket->largest)) return false;
  }
  std::array<char, kRead_bytes> buffer{};
  while (!one.wire.empty()) {
    if (::recv(one.fd, buffer.data(), buffer.size(), 0) <= 0) return false;
  }
  return true;
}

void Bus::arrive(Connection& one, std::span<const std::string> parts) {
  Socket& socket = *one.socket;
  Message message;
  const auto add = [&](std::string_view bytes, bool more) {
    message.push_back({std::make_shared<Content>(bytes), more, one.fd, one.address, one.user});
  };
  if (socket.type == ZMQ_ROUTER) add(one.route, true);
  for (const std::string& part : parts) add(part, &part != &parts.back());
  if (socket.type == ZMQ_ROUTER) return one.inbox->messages.push_back(std::move(message));
  const std::string& text = parts[0];
  const auto topic = std::ranges::find(one.subscriptions, text.substr(1));
  const bool isKnown = topic != one.subscriptions.end();
  if (text.starts_with('\1') && !isKnown) one.subscriptions.push_back(text.substr(1));
  if (text.starts_with('\0') && isKnown) one.subscriptions.erase(topic);
  if (socket.type == ZMQ_XPUB) socket.subscriptions.push_back(std::move(message));
}

/// libzmq notices that the connection has ended, and forgets what waits for its peer.
void Bus::end(Connection& one) {
  if (std::exchange(one.hasEnded, true)) return;
  open_.push_back(one.fd);
  one.wire.clear();
  char byte = 0;
  (void)::recv(one.fd, &byte, 1, 0);
  Socket* const socket = one.socket;
  one.queue.clear();
  one.kernel.clear();
  one.kernel_bytes = 0;
  if (socket == nullptr) return;
  tellMonitor(*socket, ZMQ_EVENT_DISCONNECTED, one.fd);
  std::erase(socket->connections, &one);
  socket->routes.erase(one.route);
  if (one.inbox) one.inbox->hasEnded = true;
  if (socket->type != ZMQ_XPUB) return;
  std::set<std::string> topics(one.subscriptions.begin(), one.subscriptions.end());
  std::ranges::copy(topics, std::back_inserter(socket->ending));
}

/// libzmq's thread and the socket's must have answered each other before the end of a connection is told. Its
/// descriptor may be another one's by then.
void Bus::tellEnds() {
  for (const auto& socket : sockets_) {
    for (const std::string& topic : std::exchange(socket->ended, {}))
      socket->subscriptions.push_back({{std::make_shared<Content>(std::string(1, '\0') + topic)}});
  }
}

void Bus::endShut() {
  for (const int fd : std::exchange(shut_, {})) {
    Connection* const one = find(fd);
    if (one == nullptr || one->hasEnded) continue;
    ++cutOff_;
    end(*one);
  }
}

void Bus::disconnect(int fd) {
  Connection* const one = find(fd);
  if (one == nullptr) return;
  end(*one);
  slow_.erase(fd);
  one->isLeft = true;
  if (one->isClosed) forget(fd);
}

void Bus::forget(int fd) {
  connections_.erase(fd);
  free_.insert(fd);
}

bool Bus::hasEnded(int fd) const {
  const Connection* const one = find(fd);
  return one == nullptr || one->hasEnded;
}

bool Bus::hasSubscriptions() const {
  return std::ranges::any_of(
      sockets_, [](const auto& socket) { return !socket->subscriptions.empty() || !socket->ending.empty(); });
}

std::size_t Bus::waitingRequests() const {
  std::size_t count = 0;
  for (const auto& socket : sockets_) {
    for (const auto& inbox : socket->inboxes) count += inbox->messages.size();
  }
  return count;
}

void Bus::turn() {
  endShut();
  endHandshakes();
  const std::int64_t passed_ns = now() - std::exchange(turned_ns_, now());
  if (passed_ns == 0) return;
  tellEnds();
  for (const int fd : std::exchange(open_, {})) {
    Connection& one = *find(fd);
    one.isClosed = true;
    if (one.isLeft) forget(fd);
  }
  for (const int fd : slow_) read(*find(fd), passed_ns);
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
  if (socket.type == ZMQ_REP) return settleHandshake(message);
  if (socket.type == ZMQ_DEALER) return passOn(socket, message);
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
