#include "base/network/socket.h"

#include "base/network/socket_file.h"

#include <sys/stat.h>

#include <filesystem>
#include <optional>
#include <utility>

namespace tractiond::network {

namespace {

Error explain(const std::string& endpoint, int error) {
  switch (error) {
  case EADDRINUSE:
    return inUse(endpoint);
  case EACCES:
  case EPERM:
  case EROFS:
    return {EX_NOPERM, "no permission to publish at " + endpoint, "", "choose another endpoint or user"};
  case EADDRNOTAVAIL:
  case ENODEV:
    return {EX_UNAVAILABLE, endpoint + " is not an address of this machine", "",
            "use one that \"ip address\" lists, or the name of its interface"};
  default:
    return {EX_CONFIG, "cannot publish at " + endpoint + ": " + zmq_strerror(error), "", ""};
  }
}

/// Returns the endpoint as ZeroMQ can bind it, which looks no name of a host up.
std::string withAddress(const std::string& endpoint) {
  constexpr std::string_view kName = "tcp://localhost:";
  return endpoint.starts_with(kName) ? "tcp://127.0.0.1:" + endpoint.substr(kName.size()) : endpoint;
}

}  // namespace

void guard(zmq::socket_t& socket, int highWaterMark, std::int64_t largestMessage) {
  // Not 0: if a socket without linger is closed at the moment when a peer disconnects that has been sent a part of a
  // message, ZeroMQ 4.3.4 aborts the whole process (session_base.cpp, clean_pipes()).
  socket.set(zmq::sockopt::linger, 100);
  socket.set(zmq::sockopt::sndhwm, highWaterMark);
  socket.set(zmq::sockopt::maxmsgsize, largestMessage);
  // Time for which a peer that connects and sends nothing holds a file descriptor [ms].
  socket.set(zmq::sockopt::handshake_ivl, 500);
  // TCP keep-alive finds a peer whose cable was pulled, and this (TCP_USER_TIMEOUT) one that reads nothing [ms].
  socket.set(zmq::sockopt::tcp_maxrt, 5000);
  // ZeroMQ's heartbeats do not serve: where a high-water mark has
  // stopped the input, a heartbeat after the connection's end makes ZeroMQ 4.3.4 abort the whole process.
  socket.set(zmq::sockopt::rcvhwm, 0);
  socket.set(zmq::sockopt::tcp_keepalive, 1);
  socket.set(zmq::sockopt::tcp_keepalive_idle, 10);
  socket.set(zmq::sockopt::tcp_keepalive_intvl, 5);
  socket.set(zmq::sockopt::tcp_keepalive_cnt, 3);
}

tl::expected<std::vector<std::string>, Error> bind(zmq::socket_t& socket, const std::vector<std::string>& endpoints) {
  std::vector<std::string> bound;
  for (const std::string& wanted : endpoints) {
    const std::string endpoint = withAddress(wanted);
    std::optional<Error> error = checkEndpoint(endpoint);
    try {
      if (!error) socket.bind(endpoint);
    } catch (const zmq::error_t& thrown) {
      error = explain(endpoint, thrown.num());
    }
    if (error) {
      release(bound);
      return tl::unexpected(*std::move(error));
    }
    const std::string file = socketFileOf(endpoint);
    if (!file.empty()) chmod(file.c_str(), 0660);  // the group may write
    bound.push_back(socket.get(zmq::sockopt::last_endpoint));
  }
  return bound;
}

void release(const std::vector<std::string>& bound) {
  std::error_code ignored;
  for (const std::string& endpoint : bound) {
    const std::string file = socketFileOf(endpoint);
    if (!file.empty()) std::filesystem::remove(file, ignored);
  }
}

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

std::string property(zmq::message_t& message, const char* name) {
  const char* const text = zmq_msg_gets(message.handle(), name);
  return text == nullptr ? "" : text;
}

std::string peerName(zmq::message_t& message) {
  constexpr std::string_view kThisHost = "localhost:";  // followed by uid:gid:pid of a process
  std::string name = property(message, "Peer-Address");
  if (name.empty()) return "an unknown peer";
  if (!name.starts_with(kThisHost)) return name;
  const std::size_t uid = kThisHost.size();
  return "uid " + name.substr(uid, name.find(':', uid) - uid) + ", pid " + name.substr(name.rfind(':') + 1);
}

}  // namespace tractiond::network
