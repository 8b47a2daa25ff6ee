// The bus as libzmq: what the program's calls about sockets return.
#include "tests/simulation/bus_parts.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <iterator>
#include <utility>

namespace tractiond::simulation {

Bus::Socket* Bus::open(int type) {
  sockets_.push_back(std::make_unique<Socket>());
  sockets_.back()->type = type;
  return sockets_.back().get();
}

void Bus::close(Socket* socket) {
  while (!socket->connections.empty()) end(*socket->connections[0]);
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
  if (option == ZMQ_XPUB_VERBOSE) socket.isVerbose = number != 0;
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

bool Bus::isReadable() const {
  return std::ranges::any_of(sockets_, [this](const auto& socket) { return canReceive(*socket); });
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

}  // namespace tractiond::simulation
