#include "gateway/messages.h"

#include <cerrno>
#include <cstring>

namespace tractiond::gateway {

std::size_t receive(zmq::socket_t& socket, std::array<zmq::message_t, 4>& parts) {
  for (std::size_t count = 0;; ++count) {
    zmq::message_t surplus;
    zmq::message_t& part = count < parts.size() ? parts[count] : surplus;
    if (zmq_msg_recv(part.handle(), socket.handle(), ZMQ_DONTWAIT) < 0) return 0;
    if (!part.more()) return count + 1;
  }
}

bool put(zmq::socket_t& socket, zmq::message_t& part, bool more) {
  int sent = -1;
  do {
    sent = zmq_msg_send(part.handle(), socket.handle(), ZMQ_DONTWAIT | (more ? ZMQ_SNDMORE : 0));
  } while (sent < 0 && zmq_errno() == EINTR);
  return sent >= 0;
}

bool putAddressed(zmq::socket_t& socket, std::string_view to, zmq::message_t body) {
  zmq::message_t address(to.data(), to.size()), empty;
  return put(socket, address, true) && put(socket, empty, true) && put(socket, body, false);
}

std::string property(zmq::message_t& message, const char* name) {
  const char* const text = zmq_msg_gets(message.handle(), name);
  return text == nullptr ? "" : text;
}

std::string Route::text() const {
  return peer + std::string(reinterpret_cast<const char*>(&generation), sizeof generation);
}

std::optional<Route> Route::of(std::string_view text) {
  Route route;
  if (text.size() < sizeof route.generation) return std::nullopt;
  const std::size_t end = text.size() - sizeof route.generation;
  std::memcpy(&route.generation, text.data() + end, sizeof route.generation);
  route.peer = text.substr(0, end);
  return route;
}

}  // namespace tractiond::gateway
