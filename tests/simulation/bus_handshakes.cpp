// The bus at both ends of a gateway: handshakes with keys, and the servers that its sockets are connected to.
#include "tests/simulation/bus_parts.h"

#include <algorithm>
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
  if (!socket.needsKey && !credentials.isSilent) return admit(one);
  handshakes_.push_back({one.id, now() + kHandshake_ns});
  if (credentials.isSilent) return;
  const auto asked = std::ranges::find_if(sockets_, [](const auto& other) { return other->type == ZMQ_REP; });
  if (credentials.key.empty() || asked == sockets_.end()) return end(one);
  (*asked)->received.push_back(
      messageOf({"1.0", std::to_string(one.id), socket.domain, *one.address, "", "CURVE", credentials.key}));
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
  const int id = one.id;
  for (const auto& parts : std::exchange(one.early, {})) send(id, parts);
}

/// Admits or ends a connection. \param answer version, id, status, text, user, metadata
void Bus::settleHandshake(const Message& answer) {
  Connection* const one = find(std::stoi(std::string(answer.at(1).content->view())));
  if (one == nullptr || one->hasEnded) return;
  if (answer.at(2).content->view() != "200") return end(*one);
  one->user = std::make_shared<std::string>(answer.at(4).content->view());
  admit(*one);
}

/// libzmq ends connections whose handshake takes too long, be it because of the peer or of the program.
void Bus::endHandshakes() {
  std::erase_if(handshakes_, [this](const auto& handshake) {
    Connection* const one = find(handshake.id);
    if (one == nullptr || one->isAdmitted || one->hasEnded) return true;
    if (handshake.until_ns > now()) return false;
    end(*one);
    return true;
  });
}

bool Bus::isAdmitted(int id) const {
  const Connection* const one = find(id);
  return one != nullptr && one->isAdmitted && !one->hasEnded;
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
