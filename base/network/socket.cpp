#include "base/network/socket.h"

#include "base/network/ends.h"
#include "base/network/inflow_limit.h"
#include "base/network/socket_file.h"

#include <sys/stat.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <optional>
#include <utility>

namespace tractiond::network {

namespace {

/// Largest message of which PeerLimit keeps a copy: the buffer of libzmq that a small message keeps is as large.
constexpr std::size_t kMostKept_bytes = 8192;

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
  // TCP keep-alive finds a peer whose cable was pulled. ZeroMQ's heartbeats do not serve: where a high-water mark has
  // stopped the input, a heartbeat after the connection's end makes ZeroMQ 4.3.4 abort the whole process.
  socket.set(zmq::sockopt::rcvhwm, 0);
  socket.set(zmq::sockopt::tcp_keepalive, 1);
  socket.set(zmq::sockopt::tcp_keepalive_idle, 10);
  socket.set(zmq::sockopt::tcp_keepalive_intvl, 5);
  socket.set(zmq::sockopt::tcp_keepalive_cnt, 3);
}

tl::expected<std::vector<std::string>, Error> bind(zmq::socket_t& socket, const std::vector<std::string>& endpoints) {
  std::vector<std::string> bound;
  const auto type = static_cast<zmq::socket_type>(socket.get(zmq::sockopt::type));
  const Charge charge = type == zmq::socket_type::router ? Charge::kRequests : Charge::kSubscriptions;
  for (const std::string& wanted : endpoints) {
    const std::string endpoint = withAddress(wanted);
    inflow::watch(endpoint, charge);  // before a peer can connect
    std::optional<Error> error = checkEndpoint(endpoint);
    try {
      if (!error) socket.bind(endpoint);
    } catch (const zmq::error_t& thrown) {
      error = explain(endpoint, thrown.num());
    }
    if (error) {
      inflow::unwatch({endpoint});
      release(bound);
      return tl::unexpected(*std::move(error));
    }
    const std::string file = socketFileOf(endpoint);
    if (!file.empty()) chmod(file.c_str(), 0660);  // the group may write
    bound.push_back(socket.get(zmq::sockopt::last_endpoint));
    inflow::watch(bound.back(), charge);
    inflow::unwatch({endpoint});  // no effect if both are the same
  }
  return bound;
}

void release(const std::vector<std::string>& bound) {
  inflow::unwatch(bound);
  std::error_code ignored;
  for (const std::string& endpoint : bound) {
    const std::string file = socketFileOf(endpoint);
    if (!file.empty()) std::filesystem::remove(file, ignored);
  }
}

std::string peerName(zmq::message_t& message) {
  constexpr std::string_view kThisHost = "localhost:";  // followed by uid:gid:pid of a process
  const char* const address = zmq_msg_gets(message.handle(), "Peer-Address");
  std::string name = address == nullptr ? "" : address;
  if (name.empty()) return "an unknown peer";
  if (!name.starts_with(kThisHost)) return name;
  const std::size_t uid = kThisHost.size();
  return "uid " + name.substr(uid, name.find(':', uid) - uid) + ", pid " + name.substr(name.rfind(':') + 1);
}

int sourceOf(zmq::message_t& message) {
  return zmq_msg_get(message.handle(), ZMQ_SRCFD);
}

const void* connectionOf(zmq::message_t& message) {
  // libzmq keeps the properties of a connection once, for all its messages: their addresses are the same.
  const char* const address = zmq_msg_gets(message.handle(), "Peer-Address");
  return address != nullptr ? address : zmq_msg_gets(message.handle(), "Socket-Type");
}

std::optional<zmq::message_t> messageOf(std::string bytes, std::shared_ptr<ReplyBudget::Reply> waiting) try {
  struct Lent {
    std::string bytes;
    std::shared_ptr<ReplyBudget::Reply> waiting;
    ~Lent() { waiting->queued.store(false, std::memory_order_release); }  // partner: ReplyBudget
  };
  // ZeroMQ's queue orders what is written here before what is read there, which the thread sanitizer does not see.
  static std::atomic<std::uint64_t> handedOver{0};
  std::unique_ptr<Lent> lent(new Lent{std::move(bytes), std::move(waiting)});
  const auto giveBack = [](void* /*bytes*/, void* hint) {
    (void)handedOver.load(std::memory_order_acquire);  // partner: below
    delete static_cast<Lent*>(hint);
  };
  zmq::message_t message(lent->bytes.data(), lent->bytes.size(), giveBack, lent.get());
  handedOver.fetch_add(1, std::memory_order_release);
  (void)lent.release();  // owned by the message now
  return message;
} catch (const zmq::error_t&) {
  return std::nullopt;
}

std::optional<zmq::message_t> copyOf(std::string_view bytes) try {
  return zmq::message_t(bytes.data(), bytes.size());
} catch (const zmq::error_t&) {
  return std::nullopt;
}

void settleSubscription(zmq::message_t& message, bool isKnown) {
  const bool takesRoom = !message.to_string_view().starts_with('\0') && !isKnown;
  if (!takesRoom) inflow::release(sourceOf(message), 1);
}

bool isConnectionTo(int fd, const std::vector<std::string>& bound) {
  const std::string end = localEnd(fd);
  return !end.empty() && std::ranges::any_of(bound, [&](const std::string& one) { return one.ends_with(end); });
}

bool cutOff(int fd, const std::vector<std::string>& bound) {
  // The peer may have gone and its descriptor been reused, but not by a connection to the camera.
  return isConnectionTo(fd, bound) && shutDown(fd);
}

void PeerLimit::count(zmq::message_t& message, std::size_t parts, const std::vector<std::string>& bound) {
  const void* const connection = connectionOf(message);
  if (connection == nullptr) return;
  const auto [counted, isNew] = counts_.try_emplace(connection);
  Count& count = counted->second;
  // Needs no memory: bytes are shared.
  if (isNew && message.size() <= kMostKept_bytes) (void)zmq_msg_copy(count.first.handle(), message.handle());
  count.parts += parts;
  if (++count.messages <= limit_) return;
  count.messages = 0;
  const int fd = sourceOf(message);
  if (inflow::sentOver(fd) >= count.parts) cutOff(fd, bound);  // else the connection has ended
}

}  // namespace tractiond::network
