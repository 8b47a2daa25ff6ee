#include "traction/subscriber.h"

#include "client/src/decode.h"
#include "client/src/locate.h"

#include <zmq.hpp>

#include <cstring>
#include <ctime>
#include <map>

namespace traction {

namespace {

/// All versions: a daemon of another one is noticed, not waited for.
constexpr std::string_view kAllVersions = "traction/";

constexpr const char* kMonitor = "inproc://monitor";

std::int64_t monotonicNow() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

unsigned topicNamed(std::string_view kind) {
  if (kind == "field") return kField;
  if (kind == "markers") return kMarkers;
  if (kind == "description") return kDescription;
  if (kind == "status") return kStatus;
  return 0;  // of a later daemon
}

Message decode(unsigned topic, std::string_view bytes) {
  switch (topic) {
  case kMarkers:
    return decodeMarkers(bytes);
  case kDescription:
    return decodeDescription(bytes);
  case kStatus:
    return decodeStatus(bytes);
  default:
    return decodeField(bytes);
  }
}

}  // namespace

struct Subscriber::Impl {
  explicit Impl(const SubscriberOptions& given)
      : options(given) {
    const bool latest = options.mode == Mode::kLatest;
    std::vector<std::string> endpoints = {options.endpoint};
    if (options.endpoint.empty()) {
      endpoints.clear();
      for (const Endpoints& found : locate(options.instance)) endpoints.push_back(latest ? found.latest : found.stream);
    }
    endpoint = endpoints.back();
    socket.set(zmq::sockopt::linger, 0);
    socket.set(zmq::sockopt::rcvhwm, options.queue);
    // A daemon's host that disappears without a word is noticed, and connected to again. Not by ZeroMQ's heartbeats:
    // one that falls due after the connection's end makes 4.3.4 abort the process where the queue is full.
    socket.set(zmq::sockopt::tcp_keepalive, 1);
    socket.set(zmq::sockopt::tcp_keepalive_idle, 10);
    socket.set(zmq::sockopt::tcp_keepalive_intvl, 5);
    socket.set(zmq::sockopt::tcp_keepalive_cnt, 3);
    if (latest) socket.set(zmq::sockopt::conflate, true);
    zmq_socket_monitor(socket.handle(), kMonitor, ZMQ_EVENT_HANDSHAKE_SUCCEEDED | ZMQ_EVENT_DISCONNECTED);
    monitor.connect(kMonitor);
    for (const std::string& each : endpoints) {
      try {
        socket.connect(each);
      } catch (const zmq::error_t& error) {
        throw Error(ErrorCode::kBadEndpoint, "cannot connect to '" + each + "': " + error.what());
      }
    }
    socket.set(zmq::sockopt::subscribe, latest ? std::string_view() : kAllVersions);
  }

  ~Impl() { zmq_socket_monitor(socket.handle(), nullptr, 0); }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  bool isConnected() {
    zmq::message_t event;
    zmq::message_t address;
    while (zmq_msg_recv(event.handle(), monitor.handle(), ZMQ_DONTWAIT) >= 0) {
      // 16 bits of event and 32 of value, then the address.
      std::uint16_t what = 0;
      std::memcpy(&what, event.data(), sizeof what);
      connections += what == ZMQ_EVENT_HANDSHAKE_SUCCEEDED ? 1 : -1;
      zmq_msg_recv(address.handle(), monitor.handle(), ZMQ_DONTWAIT);
    }
    return connections > 0;
  }

  /// The parts of the next message: [topic][payload][time], or [payload]. False: none.
  bool next(std::chrono::milliseconds timeout) {
    zmq_pollitem_t item{socket.handle(), 0, ZMQ_POLLIN, 0};
    if (zmq_poll(&item, 1, timeout.count()) <= 0) return false;
    for (count = 0;; ++count) {
      zmq::message_t surplus;
      zmq::message_t& part = count < parts.size() ? parts[count] : surplus;
      if (zmq_msg_recv(part.handle(), socket.handle(), ZMQ_DONTWAIT) < 0) return false;
      if (!part.more()) break;
    }
    ++count;
    return true;
  }

  void countLosses(const std::string& topic, const Header& header) {
    auto& [boot, sequence] = seen[topic];
    if (boot == header.boot && sequence != 0 && header.sequence > sequence + 1) lost += header.sequence - sequence - 1;
    boot = header.boot;
    sequence = header.sequence;
  }

  std::optional<Message> take(std::int64_t now_ns) {
    Message message;
    std::string topic;
    if (options.mode == Mode::kLatest) {
      message = decodeField(parts[0].to_string_view());
    } else {
      topic = parts[0].to_string();
      if (topic.rfind(kTopicRoot, 0) != 0) {
        throw Error(ErrorCode::kVersion,
                    endpoint + " publishes " + topic + ", this library reads " + std::string(kTopicRoot));
      }
      // traction/v1/<sensor>/<kind>/
      const std::size_t slash = topic.find('/', kTopicRoot.size());
      const unsigned kind = slash == std::string::npos || topic.back() != '/' || topic.size() < slash + 2
                                ? 0
                                : topicNamed(std::string_view(topic).substr(slash + 1, topic.size() - slash - 2));
      if ((kind & options.topics) == 0) return std::nullopt;
      if (count < 2) throw Error(ErrorCode::kMalformed, endpoint + " sends a topic without a message");
      message = decode(kind, parts[1].to_string_view());
    }
    Header& header = std::visit([](auto& any) -> Header& { return any.header; }, message);
    header.arrived_ns = now_ns;
    if (options.mode == Mode::kStream) countLosses(topic, header);
    return message;
  }

  SubscriberOptions options;
  std::string endpoint;
  std::uint64_t lost = 0;
  std::map<std::string, std::pair<Id, std::uint64_t>> seen;  ///< topic -> last boot and sequence
  std::array<zmq::message_t, 3> parts;
  std::size_t count = 0;
  zmq::context_t context{1};
  zmq::socket_t socket{context, zmq::socket_type::sub};
  zmq::socket_t monitor{context, zmq::socket_type::pair};
  int connections = 0;
};

Subscriber::Subscriber(const SubscriberOptions& options)
    : impl_(std::make_unique<Impl>(options)) {}
Subscriber::~Subscriber() = default;
Subscriber::Subscriber(Subscriber&&) noexcept = default;
Subscriber& Subscriber::operator=(Subscriber&&) noexcept = default;

std::optional<Message> Subscriber::receive(std::chrono::milliseconds timeout) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point end = Clock::now() + timeout;
  for (;;) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - Clock::now());
    if (!impl_->next(std::max(left, std::chrono::milliseconds(0)))) return std::nullopt;
    if (auto message = impl_->take(monotonicNow())) return message;
  }
}

std::uint64_t Subscriber::lost() const {
  return impl_->lost;
}

bool Subscriber::isConnected() const {
  return impl_->isConnected();
}

const std::string& Subscriber::endpoint() const {
  return impl_->endpoint;
}

}  // namespace traction
