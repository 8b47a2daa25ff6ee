#include "gateway/front.h"

#include "base/network/socket.h"

#include <string_view>
#include <utility>

namespace tractiond::gateway {
namespace {

/// Largest message that a subscriber may send [bytes]. The largest handshake message of CURVE has about 300.
constexpr std::int64_t kLargestSubscription = 512;
constexpr std::int64_t kLargestMessage = 65'536 + 64;  ///< of a request when encrypted [bytes]
constexpr int kWaitingPreviews = 2;                    ///< per peer
constexpr int kWaitingReplies = 16;                    ///< per peer, equal to the instrument's limit
constexpr int kHandshakesPerTurn = 64;

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
    , refused_(std::move(refused)) {
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
    }
    if (options.server) {
      socket.set(zmq::sockopt::curve_server, true);
      socket.set(zmq::sockopt::curve_secretkey, options.server->secretKey);
      socket.set(zmq::sockopt::zap_domain, kNames[way]);
    }
  }
  sockets_[kStream].set(zmq::sockopt::xpub_verbose, true);  // each new subscriber gets the description
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

zmq_pollitem_t Front::handshakes() {
  return network::readable(handshakes_);
}

void Front::serve() {
  std::vector<std::string> parts;
  for (int i = 0; i < kHandshakesPerTurn && receive(handshakes_, parts); ++i) {
    const HandshakeAnswer answer = answerHandshake(std::move(parts), mayEnter_);
    if (!answer.refused.empty()) refused_(answer.refused);
    for (const std::string& part : answer.parts) {
      zmq_send(handshakes_.handle(), part.data(), part.size(),
               ZMQ_DONTWAIT | (&part == &answer.parts.back() ? 0 : ZMQ_SNDMORE));
    }
  }
}

}  // namespace tractiond::gateway
