#include "tests/simulation/bus.h"

#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
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

struct Bus::Socket {
  int type = 0, port = 0;
  std::string endpoint;
  std::int64_t largest = -1;
  std::size_t highWaterMark = 1000;
  bool conflates = false;
  std::vector<Connection*> connections;
  Message outgoing;                            ///< parts of a message that is not complete
  std::deque<Part> incoming;                   ///< parts of the message that is being received
  std::deque<Message> subscriptions;           ///< and cancellations, in their order
  std::deque<std::shared_ptr<Inbox>> inboxes;  ///< the first one is to be served next
  std::map<std::string, Connection*> routes;
  std::uint64_t routesSoFar = 0;
};

struct Bus::Connection {
  Socket* socket;
  Peer* peer;
  std::shared_ptr<const std::string> address;
  std::int64_t reads_bytesPerMs;
  int fd;
  std::uint64_t cookie;
  std::string wire = {};  ///< from the peer, not read yet
  bool isShut = false, hasEnded = false;
  std::string route = {};
  std::shared_ptr<Inbox> inbox = {};
  std::vector<std::string> subscriptions = {};
  struct Waiting {
    Message message;
    std::uint64_t number;
  };
  std::deque<Waiting> queue = {};  ///< that libzmq holds
  struct Written {
    std::vector<std::string> parts;
    std::size_t bytes;
    std::uint64_t number;
  };
  std::deque<Written> kernel = {};
  std::size_t kernel_bytes = 0, isRead_bytes = 0;  ///< of the first one
  std::int64_t passed_ns = 0;                      ///< in which it has read nothing yet
};

Bus*& bus() {
  static Bus* one = nullptr;
  return one;
}

Bus::Bus()
    : turned_ns_(now()) {}

Bus::~Bus() = default;

Bus::Connection* Bus::find(int fd) {
  const auto one = connections_.find(fd);
  return one == connections_.end() ? nullptr : &one->second;
}

const Bus::Connection* Bus::find(int fd) const {
  const auto one = connections_.find(fd);
  return one == connections_.end() ? nullptr : &one->second;
}

int Bus::connect(int port, Peer& peer, const std::string& address, std::int64_t reads_bytesPerMs) {
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
  socket.connections.push_back(&one);
  if (reads_bytesPerMs > 0) slow_.insert(fd);
  if (socket.type == ZMQ_ROUTER) {
    const auto number = static_cast<std::uint32_t>(++socket.routesSoFar);
    one.route.resize(5);
    for (std::size_t i = 1; i < 5; ++i) one.route[i] = static_cast<char>(number >> (32 - 8 * i));
    socket.routes[one.route] = &one;
    one.inbox = std::make_shared<Inbox>();
    socket.inboxes.push_back(one.inbox);
  }
  std::string greeting(kGreeting, '\0');
  greeting[0] = '\xff';
  greeting[9] = '\x7f';
  greeting[10] = 3;
  one.wire = greeting + std::string("\4\6\5READY", 8);
  return fd;
}

void Bus::send(int fd, std::span<const std::string> parts, bool isWhole) {
  Connection* const one = find(fd);
  if (one == nullptr || one->hasEnded) return;
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
    message.push_back({std::make_shared<Content>(bytes), more, one.fd, one.address});
  };
  if (socket.type == ZMQ_ROUTER) add(one.route, true);
  for (const std::string& part : parts) add(part, &part != &parts.back());
  if (socket.type == ZMQ_ROUTER) return one.inbox->messages.push_back(std::move(message));
  const std::string& text = parts[0];
  if (text.starts_with('\1')) one.subscriptions.push_back(text.substr(1));
  if (text.starts_with('\0')) {
    const auto topic = std::ranges::find(one.subscriptions, text.substr(1));
    if (topic != one.subscriptions.end()) one.subscriptions.erase(topic);
  }
  if (socket.type == ZMQ_XPUB) socket.subscriptions.push_back(std::move(message));
}

/// libzmq notices that the connection has ended, and forgets what waits for its peer.
void Bus::end(Connection& one) {
  if (std::exchange(one.hasEnded, true)) return;
  one.wire.clear();
  char byte = 0;
  (void)::recv(one.fd, &byte, 1, 0);
  Socket* const socket = one.socket;
  one.queue.clear();
  one.kernel.clear();
  one.kernel_bytes = 0;
  if (socket == nullptr) return;
  std::erase(socket->connections, &one);
  socket->routes.erase(one.route);
  if (one.inbox) one.inbox->hasEnded = true;
  if (socket->type != ZMQ_XPUB) return;
  std::set<std::string> topics(one.subscriptions.begin(), one.subscriptions.end());
  for (const std::string& topic : topics)
    socket->subscriptions.push_back({{std::make_shared<Content>(std::string(1, '\0') + topic)}});
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
  connections_.erase(fd);
  slow_.erase(fd);
  free_.insert(fd);
}

bool Bus::hasEnded(int fd) const {
  const Connection* const one = find(fd);
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
  endShut();
  const std::int64_t passed_ns = now() - std::exchange(turned_ns_, now());
  if (passed_ns == 0) return;
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

Bus::Socket* Bus::open(int type) {
  sockets_.push_back(std::make_unique<Socket>());
  sockets_.back()->type = type;
  return sockets_.back().get();
}

void Bus::close(Socket* socket) {
  while (!socket->connections.empty()) end(*socket->connections[0]);
  for (auto& [fd, one] : connections_) {
    if (one.socket == socket) one.socket = nullptr;
  }
  std::erase_if(sockets_, [socket](const auto& one) { return one.get() == socket; });
}

int Bus::set(Socket& socket, int option, const void* value, std::size_t size) {
  std::int64_t number = 0;
  if (size == sizeof(int)) {
    int small = 0;
    std::memcpy(&small, value, size);
    number = small;
  } else if (size == sizeof number) {
    std::memcpy(&number, value, size);
  }
  if (option == ZMQ_SNDHWM) socket.highWaterMark = number == 0 ? SIZE_MAX : static_cast<std::size_t>(number);
  if (option == ZMQ_MAXMSGSIZE) socket.largest = number;
  if (option == ZMQ_CONFLATE) socket.conflates = number != 0;
  return 0;
}

int Bus::get(const Socket& socket, int option, void* value, std::size_t* size) const {
  if (option == ZMQ_TYPE) {
    std::memcpy(value, &socket.type, sizeof socket.type);
    *size = sizeof socket.type;
    return 0;
  }
  if (option == ZMQ_LAST_ENDPOINT && *size > socket.endpoint.size()) {
    *size = socket.endpoint.size() + 1;
    std::memcpy(value, socket.endpoint.c_str(), *size);
    return 0;
  }
  errno = EINVAL;
  return -1;
}

int Bus::bind(Socket& socket, const std::string& endpoint) {
  socket.endpoint = endpoint;
  socket.port = std::stoi(endpoint.substr(endpoint.rfind(':') + 1));
  return 0;
}

void Bus::send(Socket& socket, Part part) {
  socket.outgoing.push_back(std::move(part));
  if (!socket.outgoing.back().more) dispatch(socket, std::exchange(socket.outgoing, {}));
}

bool Bus::canReceive(const Socket& socket) const {
  return !socket.incoming.empty() || !socket.subscriptions.empty() ||
         std::ranges::any_of(socket.inboxes, [](const auto& inbox) { return !inbox->messages.empty(); });
}

/// Requests are taken from the connections in turn, one from each.
bool Bus::receive(Socket& socket, Part& part) {
  if (socket.incoming.empty()) {
    Message message;
    if (!socket.subscriptions.empty()) {
      message = std::move(socket.subscriptions.front());
      socket.subscriptions.pop_front();
    }
    for (std::size_t i = socket.inboxes.size(); i > 0 && message.empty(); --i) {
      const auto inbox = std::move(socket.inboxes.front());
      socket.inboxes.pop_front();
      if (!inbox->messages.empty()) {
        message = std::move(inbox->messages.front());
        inbox->messages.pop_front();
      }
      if (!inbox->messages.empty() || !inbox->hasEnded) socket.inboxes.push_back(inbox);
    }
    socket.incoming.assign(std::make_move_iterator(message.begin()), std::make_move_iterator(message.end()));
  }
  if (socket.incoming.empty()) return false;
  part = std::move(socket.incoming.front());
  socket.incoming.pop_front();
  return true;
}

std::string Bus::localEnd(int fd) const {
  const Connection* const one = find(fd);
  return one == nullptr || one->socket == nullptr || one->hasEnded ? "" : ":" + std::to_string(one->socket->port);
}

std::string Bus::peerOf(int fd) const {
  const Connection* const one = find(fd);
  return one == nullptr ? "" : *one->address;
}

std::uint64_t Bus::cookieOf(int fd) const {
  const Connection* const one = find(fd);
  return one == nullptr ? 0 : one->cookie;
}

std::optional<network::Unread> Bus::unreadOf(int fd) const {
  const Connection* const one = find(fd);
  if (one == nullptr || one->hasEnded) return std::nullopt;
  return network::Unread{one->cookie, static_cast<int>(one->kernel_bytes)};
}

int Bus::endOfDescriptorTable() const {
  return next_;
}

ssize_t Bus::receive(int fd, void* buffer, std::size_t size) {
  Connection* const one = find(fd);
  if (one == nullptr || one->hasEnded || one->isShut) return 0;
  const std::size_t some = std::min(size, one->wire.size());
  std::memcpy(buffer, one->wire.data(), some);
  one->wire.erase(0, some);
  return static_cast<ssize_t>(some);
}

bool Bus::shutDown(int fd) {
  Connection* const one = find(fd);
  if (one == nullptr || one->hasEnded) return false;
  one->isShut = true;
  shut_.push_back(fd);
  return true;
}

}  // namespace tractiond::simulation

namespace tractiond::network {

using simulation::bus;

std::string localEnd(int fd) {
  return bus() == nullptr ? "" : bus()->localEnd(fd);
}
std::string peerOf(int fd) {
  return bus() == nullptr ? "" : bus()->peerOf(fd);
}
std::uint64_t cookieOf(int fd) {
  return bus() == nullptr ? 0 : bus()->cookieOf(fd);
}
std::optional<Unread> unreadOf(int fd) {
  return bus() == nullptr ? std::nullopt : bus()->unreadOf(fd);
}
int endOfDescriptorTable() {
  return bus() == nullptr ? 0 : bus()->endOfDescriptorTable();
}
ssize_t receive(int fd, void* buffer, std::size_t size, int /*flags*/) {
  return bus() == nullptr ? 0 : bus()->receive(fd, buffer, size);
}
bool shutDown(int fd) {
  return bus() != nullptr && bus()->shutDown(fd);
}

}  // namespace tractiond::network
