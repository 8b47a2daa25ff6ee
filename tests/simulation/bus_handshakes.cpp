// The bus at both ends of a gateway: handshakes with keys, monitors of connections, and the servers that its sockets
// are connected to.
#include "tests/simulation/bus_parts.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

namespace tractiond::simulation {
namespace {

constexpr std::int64_t kHandshake_ns = 500 * kMs;  // ZMQ_HANDSHAKE_IVL of network::guard()
constexpr std::size_t kQueue = 1000;               // ZMQ_RCVHWM

Message messageOf(std::initializer_list<std::string_view> parts) {
  Message message;
  for (const std::string_view& part : parts)
    message.push_back({std::make_shared<Content>(part), &part != parts.end() - 1});
  return message;
}

}  // namespace

/// Sends the key of a new peer to the handler of handshakes (ZAP, RFC 27), where a key is needed; else admits the peer.
void Bus::greet(Connection& one, const Credentials& credentials) {
  const Socket& socket = *one.socket;
  tellMonitor(socket, ZMQ_EVENT_ACCEPTED, one.fd);
  if (!socket.needsKey && !credentials.isSilent) return admit(one);
  handshakes_.push_back({one.fd, one.cookie, now() + kHandshake_ns});
  if (credentials.isSilent) return;
  const auto asked = std::ranges::find_if(sockets_, [](const auto& other) { return other->type == ZMQ_REP; });
  if (credentials.key.empty() || asked == sockets_.end()) return end(one);
  (*asked)->received.push_back(
      messageOf({"1.0", std::to_string(one.cookie), socket.domain, *one.address, "", "CURVE", credentials.key}));
}

/// Makes a peer a part of its socket, and processes what it has sent before.
void Bus::admit(Connection& one) {
  Socket& socket = *one.socket;
  one.isAdmitted = true;
  socket.connections.push_back(&one);
  if (socket.type == ZMQ_ROUTER) {
    const auto number = static_cast<std::uint32_t>(++socket.routesSoFar);
    one.route.resize(5);
    for (std::size_t i = 1; i < 5; ++i) one.route[i] = static_cast<char>(number >> (32 - 8 * i));
    socket.routes[one.route] = &one;
    one.inbox = std::make_shared<Inbox>();
    socket.inboxes.push_back(one.inbox);
  }
  const int fd = one.fd;
  for (const auto& [parts, isWhole] : std::exchange(one.early, {})) send(fd, parts, isWhole);
}

/// Admits or ends a connection. \param answer version, id, status, text, user, metadata
void Bus::settleHandshake(const Message& answer) {
  const std::uint64_t cookie = std::stoull(std::string(answer.at(1).content->view()));
  const auto one =
      std::ranges::find_if(connections_, [cookie](const auto& each) { return each.second.cookie == cookie; });
  if (one == connections_.end() || one->second.hasEnded || one->second.isShut) return;
  if (answer.at(2).content->view() != "200") return end(one->second);
  one->second.user = std::make_shared<std::string>(answer.at(4).content->view());
  admit(one->second);
}

/// libzmq ends connections whose handshake takes too long, be it because of the peer or of the program.
void Bus::endHandshakes() {
  std::erase_if(handshakes_, [this](const auto& handshake) {
    Connection* const one = find(handshake.fd);
    if (one == nullptr || one->cookie != handshake.cookie || one->isAdmitted || one->hasEnded) return true;
    if (handshake.until_ns > now()) return false;
    end(*one);
    return true;
  });
}

bool Bus::isAdmitted(int fd) const {
  const Connection* const one = find(fd);
  return one != nullptr && one->isAdmitted && !one->hasEnded;
}

int Bus::monitor(Socket& socket, const std::string& endpoint) {
  socket.monitor = endpoint;
  return 0;
}

/// Sends an event to the monitor of a socket: event (16 bits) and value (32 bits), then the address, left empty.
void Bus::tellMonitor(const Socket& socket, int event, int fd) {
  if (socket.monitor.empty()) return;
  const auto told = std::ranges::find_if(sockets_, [&](const auto& other) { return other->server == socket.monitor; });
  if (told == sockets_.end()) return;
  const auto small = static_cast<std::uint16_t>(event);
  const auto value = static_cast<std::int32_t>(fd);
  std::array<char, sizeof small + sizeof value> bytes{};
  std::memcpy(bytes.data(), &small, sizeof small);
  std::memcpy(bytes.data() + sizeof small, &value, sizeof value);
  (*told)->received.push_back(messageOf({std::string_view(bytes.data(), bytes.size()), ""}));
}

bool Bus::hasEvents() const {
  return std::ranges::any_of(sockets_,
                             [](const auto& socket) { return socket->type == ZMQ_PAIR && !socket->received.empty(); });
}

int Bus::connect(Socket& socket, const std::string& endpoint) {
  socket.server = endpoint;
  return 0;
}

void Bus::subscribe(Socket& socket, std::string_view topic, bool wants) {
  const auto one = std::ranges::find(socket.wants, topic);
  if (wants) {
    socket.wants.emplace_back(topic);
  } else if (one != socket.wants.end()) {
    socket.wants.erase(one);
  }
  passOn(socket, messageOf({std::string(1, wants ? '\1' : '\0') + std::string(topic)}));
}

bool Bus::canSend(const Socket& socket) const {
  return socket.type != ZMQ_DEALER || servers_.contains(socket.server);
}

/// Hands a message to the server that the socket is connected to, if it is there.
void Bus::passOn(const Socket& socket, const Message& message) {
  const auto server = servers_.find(socket.server);
  if (server == servers_.end()) return;
  std::vector<std::string_view> parts;
  for (const Part& part : message) parts.push_back(part.content->view());
  server->second->heed(socket.server, parts);
}

void Bus::listen(const std::string& endpoint, Server& server) {
  servers_[endpoint] = &server;
  for (const auto& socket : sockets_) {
    if (socket->server != endpoint) continue;
    for (const std::string& topic : socket->wants) passOn(*socket, messageOf({"\1" + topic}));
  }
}

void Bus::stopListening(const std::string& endpoint) {
  servers_.erase(endpoint);
}

void Bus::sendFrom(const std::string& endpoint, std::span<const std::string> parts) {
  for (const auto& socket : sockets_) {
    if (socket->server != endpoint) continue;
    const bool wants = socket->type != ZMQ_SUB || std::ranges::any_of(socket->wants, [&](const std::string& topic) {
                         return parts[0].starts_with(topic);
                       });
    if (!wants) continue;
    Message message;
    for (const std::string& part : parts) message.push_back({std::make_shared<Content>(part), &part != &parts.back()});
    if (socket->conflates) socket->received.clear();
    if (socket->type != ZMQ_SUB || socket->received.size() < kQueue) socket->received.push_back(std::move(message));
  }
}

}  // namespace tractiond::simulation
