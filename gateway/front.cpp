#include "gateway/front.h"

#include "base/network/socket.h"

#include <algorithm>
#include <cstring>
#include <string_view>
#include <utility>

namespace tractiond::gateway {
namespace {

/// Largest message that a subscriber may send [bytes]. The largest handshake message of CURVE has about 300.
constexpr std::int64_t kLargestSubscription = 512;
constexpr std::int64_t kLargestMessage = 65'536 + 64;  ///< of a request when encrypted [bytes]
constexpr int kWaitingPreviews = 2;                    ///< per peer
constexpr int kWaitingReplies = 16;                    ///< per peer, equal to the instrument's limit
/// [bytes] Data of a flooding peer that is already in this buffer still arrives after the peer is disconnected.
constexpr int kReceiveBuffer = 4096;
constexpr int kHandshakesPerTurn = 64;
constexpr int kEventsPerTurn = 1024;

constexpr std::array<std::string_view, kWays> kNames = {"stream", "latest", kControlDomain, kPreviewDomain};

/// Reads all parts of the next message. Returns false if there is none. Never waits.
bool receive(zmq::socket_t& socket, std::vector<std::string>& parts) {
  parts.clear();
  for (;;) {
    zmq::message_t part;
    if (zmq_msg_recv(part.handle(), socket.handle(), ZMQ_DONTWAIT) < 0) return false;
    parts.push_back(part.to_string());
    if (!part.more()) return true;
  }
}

}  // namespace

Front::Front(const Options& options, MayEnter mayEnter, Refused refused)
    : mayEnter_(std::move(mayEnter))
    , refused_(std::move(refused))
    , peers_(options.limits.peers, options.limits.peersPerAddress) {
  constexpr std::array kTypes = {zmq::socket_type::xpub, zmq::socket_type::pub, zmq::socket_type::router,
                                 zmq::socket_type::xpub};
  if (options.server) {
    handshakes_.set(zmq::sockopt::linger, 0);
    handshakes_.bind("inproc://zeromq.zap.01");
  }
  for (std::size_t way = 0; way < kWays; ++way) {
    zmq::socket_t& socket = sockets_[way] = zmq::socket_t(context_, kTypes[way]);
    if (way == kControl) {
      network::guard(socket, kWaitingReplies, kLargestMessage);
    } else {
      network::guard(socket, way == kPreview ? kWaitingPreviews : options.highWaterMark, kLargestSubscription);
      socket.set(zmq::sockopt::rcvbuf, kReceiveBuffer);
    }
    if (options.server) {
      socket.set(zmq::sockopt::curve_server, true);
      socket.set(zmq::sockopt::curve_secretkey, options.server->secretKey);
      socket.set(zmq::sockopt::zap_domain, kNames[way]);
    }
    const std::string monitor = "inproc://peers-" + std::string(kNames[way]);
    zmq_socket_monitor(socket.handle(), monitor.c_str(), ZMQ_EVENT_ACCEPTED | ZMQ_EVENT_DISCONNECTED);
    monitors_[way] = zmq::socket_t(context_, zmq::socket_type::pair);
    monitors_[way].set(zmq::sockopt::rcvhwm, 0);  // unread events would otherwise stop ZeroMQ's thread
    monitors_[way].set(zmq::sockopt::linger, 0);
    monitors_[way].connect(monitor);
  }
  for (const Way way : {kStream, kPreview}) sockets_[way].set(zmq::sockopt::xpub_verboser, true);
  sockets_[kLatest].set(zmq::sockopt::conflate, true);
}

Front::~Front() {
  for (const auto& endpoints : bound_) network::release(endpoints);
}

tl::expected<std::unique_ptr<Front>, Error> Front::open(const Options& options, MayEnter mayEnter,
                                                        Refused refused) try {
  std::unique_ptr<Front> front(new Front(options, std::move(mayEnter), std::move(refused)));
  for (std::size_t way = 0; way < kWays; ++way) {
    auto bound = network::bind(front->sockets_[way], options.endpoints[way]);
    if (!bound) return tl::unexpected(bound.error());
    front->bound_[way] = *std::move(bound);
  }
  return front;
} catch (const zmq::error_t& error) {
  return tl::unexpected(Error{EX_OSERR, std::string("ZeroMQ cannot start: ") + error.what(), "", ""});
}

std::vector<zmq_pollitem_t> Front::others() {
  std::vector<zmq_pollitem_t> items = {network::readable(handshakes_)};
  for (zmq::socket_t& monitor : monitors_) items.push_back(network::readable(monitor));
  return items;
}

void Front::serve() {
  std::vector<std::string> parts;
  for (std::size_t way = 0; way < kWays; ++way) takeEvents(static_cast<Way>(way));
  for (int i = 0; i < kHandshakesPerTurn && receive(handshakes_, parts); ++i) {
    const HandshakeAnswer answer = answerHandshake(std::move(parts), mayEnter_);
    if (!answer.refused.empty()) refused_(answer.refused);
    for (const std::string& part : answer.parts) {
      zmq_send(handshakes_.handle(), part.data(), part.size(),
               ZMQ_DONTWAIT | (&part == &answer.parts.back() ? 0 : ZMQ_SNDMORE));
    }
  }
}

void Front::takeEvents(Way way) {
  std::vector<std::string> parts;
  for (int i = 0; i < kEventsPerTurn && receive(monitors_[way], parts); ++i) {
    // The event (16 bits) and its value (32 bits); the address follows in the next part.
    std::uint16_t event = 0;
    std::int32_t fd = -1;
    if (parts[0].size() < sizeof event + sizeof fd) continue;
    std::memcpy(&event, parts[0].data(), sizeof event);
    std::memcpy(&fd, parts[0].data() + sizeof event, sizeof fd);
    if (event == ZMQ_EVENT_ACCEPTED) peers_.came(fd, bound_[way]);
    if (event == ZMQ_EVENT_DISCONNECTED) peers_.went(fd, bound_[way]);
  }
}

}  // namespace tractiond::gateway
