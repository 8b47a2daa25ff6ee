#include "traction/subscriber.h"

#include "base/clock.h"
#include "base/printable.h"
#include "client/src/deadline.h"
#include "client/src/decode.h"
#include "client/src/handshake.h"
#include "client/src/locate.h"
#include "client/src/paired_contacts.h"
#include "client/src/sources.h"

#include <zmq.hpp>

#include <algorithm>
#include <map>
#include <set>
#include <utility>

namespace traction {

namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

/// Time until an endpoint that ZeroMQ has given up is tried again.
constexpr auto kRetry = 200ms;
constexpr std::int64_t kRetry_ns = std::chrono::nanoseconds(kRetry).count();

/// Time without a message on a new connection until the subscription is sent again.
constexpr auto kUnheard = 1s;
constexpr std::int64_t kUnheard_ns = std::chrono::nanoseconds(kUnheard).count();

/// Time without a message of traction-touch after which its contacts end. It sends one for each field, and while there
/// are contacts at least two a second.
constexpr std::int64_t kTouchSilence_ns = std::chrono::nanoseconds(1s).count();

/// Beginning of every topic, of all protocol versions.
constexpr std::string_view kTopics = "traction/";

/// Protobuf key of Field.timestamp, which is the first field of a message and never 0.
constexpr std::string_view kFieldBegins = "\x09";

constexpr std::size_t kLongestTopic = 64;  // quoted in messages

constexpr std::int64_t kLargestPart_bytes = 128 << 20;  // a picture of 40 million pixels of 24 bits

/// Messages that wait in kLatest, of which all but the newest are passed over.
constexpr int kLatestQueue = 1000;
/// Silence after which nothing waits in the network: what waits there comes as fast as it is read.
constexpr auto kQuiet = 5ms;
/// Longest time until that silence: a publisher may never be silent for so long.
constexpr auto kCatchUp = 50ms;
/// Messages passed over at once: a publisher may be faster than it is read.
constexpr int kMostPassed = 100 * kLatestQueue;

constexpr const char* kMonitor = "inproc://monitor";

/// Returns the topic bit of traction/v1/<sensor>/<kind>/; 0 for a kind that this version does not know.
unsigned kindOf(std::string_view topic) {
  const std::size_t slash = topic.find('/', kTopicRoot.size());
  if (slash == std::string_view::npos || topic.back() != '/' || topic.size() < slash + 2) return 0;
  const auto* kind =
      std::find(kTopicKinds.begin(), kTopicKinds.end(), topic.substr(slash + 1, topic.size() - slash - 2));
  return kind == kTopicKinds.end() ? 0U : 1U << (kind - kTopicKinds.begin());
}

}  // namespace

std::optional<Message> decode(const Raw& raw) {
  if (raw.topic.substr(0, kTopicRoot.size()) != kTopicRoot) {
    throw Error(ErrorCode::kVersion, "the topic is " + printable(raw.topic.substr(0, kLongestTopic)) +
                                         ", this library reads " + std::string(kTopicRoot));
  }
  const unsigned kind = kindOf(raw.topic);
  if (kind == 0) return std::nullopt;
  return decode(kind, raw.bytes);
}

struct Subscriber::Impl {
  explicit Impl(const SubscriberOptions& given)
      : options(given) {
    if (options.monotonicClock == nullptr) options.monotonicClock = tractiond::monotonicNow;
    const bool latest = options.mode == Mode::kLatest;
    // The stream subscribes to everything, so that a daemon of another version or a wrong endpoint is detected instead
    // of waited for. Latest subscribes to the first byte of a field, and receives nothing of a stream. It skips older
    // fields itself: ZeroMQ 4.3.4 aborts the process if a message in parts reaches a socket with ZMQ_CONFLATE.
    subscription = latest ? kFieldBegins : std::string_view();
    if (!options.endpoint.empty()) {
      endpoints = {options.endpoint};
    } else if (latest || (options.topics & ~kOfTouch) != 0) {
      for (const Endpoints& found : locate(options.instance)) endpoints.push_back(latest ? found.latest : found.stream);
    }
    if (!endpoints.empty()) endpoint = endpoints.back();
    if (options.endpoint.empty() && !latest && (options.topics & kOfTouch) != 0) {
      for (const Endpoints& found : locate(options.instance, kTouch)) {
        if (!endpoint.empty()) ofTouch.insert(found.stream);
        endpoints.push_back(found.stream);
      }
    }
    if (endpoint.empty()) endpoint = endpoints.back();
    socket.set(zmq::sockopt::linger, 0);
    socket.set(zmq::sockopt::rcvhwm, latest ? kLatestQueue : options.queue);
    // Keep-alive detects a daemon's host that disappears silently, and the socket reconnects. ZeroMQ's own heartbeats
    // are not used: in 4.3.4 a heartbeat that falls due after the connection's end aborts the process if the queue is
    // full.
    socket.set(zmq::sockopt::tcp_keepalive, 1);
    socket.set(zmq::sockopt::tcp_keepalive_idle, 10);
    socket.set(zmq::sockopt::tcp_keepalive_intvl, 5);
    socket.set(zmq::sockopt::tcp_keepalive_cnt, 3);
    socket.set(zmq::sockopt::maxmsgsize, kLargestPart_bytes);
    useKeys(socket, options.keys);
    handshake.emplace(endpoint, !options.keys.serverKey.empty());
    zmq_socket_monitor(socket.handle(), kMonitor,
                       kHandshakeEvents | ZMQ_EVENT_DISCONNECTED | ZMQ_EVENT_CONNECT_RETRIED);
    monitor.set(zmq::sockopt::rcvhwm, 0);  // unread events would otherwise stop ZeroMQ's thread
    monitor.connect(kMonitor);
    for (const std::string& each : endpoints) {
      try {
        socket.connect(each);
      } catch (const zmq::error_t& error) {
        throw badEndpoint(each, error.what());
      }
    }
    socket.set(zmq::sockopt::subscribe, subscription);
  }

  ~Impl() { zmq_socket_monitor(socket.handle(), nullptr, 0); }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  /// Reads all pending monitor events: updates `connections`, `unheardSince_ns`, `givenUp` and `refusal`.
  void takeEvents() {
    zmq::message_t event;
    zmq::message_t address;
    while (zmq_msg_recv(event.handle(), monitor.handle(), ZMQ_DONTWAIT) >= 0) {
      const auto [what, value] = eventOf(event);
      zmq_msg_recv(address.handle(), monitor.handle(), ZMQ_DONTWAIT);
      if (auto why = handshake->process(what, value)) refusal = std::move(why);
      switch (what) {
      case ZMQ_EVENT_HANDSHAKE_SUCCEEDED:
        connections.insert(address.to_string());
        unheardSince_ns = options.monotonicClock();
        break;
      case ZMQ_EVENT_DISCONNECTED:  // also after a failed handshake, without a connection
        connections.erase(address.to_string());
        givenUp[address.to_string()] = options.monotonicClock() + kRetry_ns;
        break;
      case ZMQ_EVENT_CONNECT_RETRIED:  // ZeroMQ retries by itself
        givenUp.erase(address.to_string());
        break;
      default:  // a failed handshake; kDisconnected follows
        break;
      }
    }
  }

  /// Connects again to endpoints given up: ZeroMQ never reconnects to a peer that did not speak its protocol, although
  /// a daemon may take that peer's place.
  void retry() {
    for (auto one = givenUp.begin(); one != givenUp.end();) {
      if (one->second > options.monotonicClock()) {
        ++one;
        continue;
      }
      for (const std::string& each : endpoints) {
        if (each != one->first && endpoints.size() > 1) continue;
        zmq_disconnect(socket.handle(), each.c_str());
        zmq_connect(socket.handle(), each.c_str());
      }
      one = givenUp.erase(one);
    }
  }

  /// Sends the subscription again if nothing was received since a connection was made: a publisher that conflates, as
  /// *latest* does, also conflates what it receives, and its ZeroMQ may drop the subscription (a `try_lock` that
  /// fails).
  void subscribeAgain() {
    if (!unheardSince_ns || connections.empty()) return;
    const std::int64_t now_ns = options.monotonicClock();
    if (now_ns - *unheardSince_ns < kUnheard_ns) return;
    socket.set(zmq::sockopt::subscribe, subscription);
    unheardSince_ns = now_ns;
  }

  /// Waits for the next message, in kLatest for the newest, and reads its parts: [topic][payload][time], or [payload]
  /// in kLatest. Returns false if there is none, also, with `isSilent`, as soon as traction-touch is silent.
  /// \throws Error kNotAllowed
  bool next(std::chrono::milliseconds timeout) {
    const Clock::time_point end = endAfter(timeout);
    isSilent = false;
    for (;;) {
      takeEvents();
      if (refusal) throw *std::exchange(refusal, std::nullopt);
      retry();
      subscribeAgain();
      auto left = std::max(std::chrono::ceil<std::chrono::milliseconds>(end - Clock::now()), 0ms);
      if (!givenUp.empty()) left = std::min<std::chrono::milliseconds>(left, kRetry);
      if (unheardSince_ns) left = std::min<std::chrono::milliseconds>(left, kUnheard);
      if (const auto heard_ns = touchHeard(); heard_ns) {
        const std::chrono::nanoseconds patience(*heard_ns + kTouchSilence_ns - options.monotonicClock());
        left = std::clamp(std::chrono::ceil<std::chrono::milliseconds>(patience), 0ms, left);
      }
      std::array<zmq_pollitem_t, 2> items = {
          {{socket.handle(), 0, ZMQ_POLLIN, 0}, {monitor.handle(), 0, ZMQ_POLLIN, 0}}};
      if (zmq_poll(items.data(), items.size(), left.count()) < 0) return false;
      if (items[0].revents != 0) return options.mode == Mode::kLatest ? readNewest() : readParts();
      // Only now: what waited was read, so that a slow reader is not taken for a silence.
      const auto heard_ns = touchHeard();
      isSilent = heard_ns && options.monotonicClock() - *heard_ns >= kTouchSilence_ns;
      if (isSilent || Clock::now() >= end) return false;
    }
  }

  /// Returns when the traction-touch that was heard longest ago, of those with contacts, was heard [ns].
  std::optional<std::int64_t> touchHeard() const {
    std::optional<std::int64_t> first_ns;
    for (const auto& [topic, touch] : touches) {
      if (touch.contacts.areOpen()) first_ns = std::min(first_ns.value_or(touch.heard_ns), touch.heard_ns);
    }
    return first_ns;
  }

  /// Ends the contacts of a silent traction-touch.
  Contacts endContacts(std::int64_t now_ns) {
    const auto longest = std::min_element(touches.begin(), touches.end(), [](const auto& a, const auto& b) {
      return std::pair(!a.second.contacts.areOpen(), a.second.heard_ns) <
             std::pair(!b.second.contacts.areOpen(), b.second.heard_ns);
    });
    Contacts ends = longest->second.contacts.endAll();
    ends.header.arrived_ns = now_ns;
    return ends;
  }

  /// Reads the parts of the next message that has arrived already. Returns false, with the parts as they were, if there
  /// is none.
  bool readParts() {
    zmq::message_t part;
    if (zmq_msg_recv(part.handle(), socket.handle(), ZMQ_DONTWAIT) < 0) return false;
    unheardSince_ns.reset();
    for (count = 0;;) {
      const bool isLast = !part.more();
      if (count < parts.size()) parts[count].swap(part);
      ++count;
      if (isLast) break;
      if (zmq_msg_recv(part.handle(), socket.handle(), ZMQ_DONTWAIT) < 0) return false;
    }
    for (std::size_t i = count; i < parts.size(); ++i) parts[i].rebuild();
    return true;
  }

  /// Reads on to the newest message. Behind a queue that was full, newer ones wait in the network: they are read until
  /// none comes for kQuiet. A queue may be full at half of its size, as ZeroMQ counts what was read in steps of that.
  bool readNewest() {
    if (!readParts()) return false;
    int passed = 0;
    for (const Clock::time_point begin = Clock::now();;) {
      while (passed < kMostPassed && readParts()) ++passed;
      if (2 * passed < kLatestQueue || passed >= kMostPassed || Clock::now() - begin > kCatchUp) break;
      zmq_pollitem_t item = {socket.handle(), 0, ZMQ_POLLIN, 0};
      if (zmq_poll(&item, 1, kQuiet.count()) <= 0) break;
    }
    return true;
  }

  bool startsWith(std::string_view beginning) const {
    return parts[0].to_string_view().substr(0, beginning.size()) == beginning;
  }

  /// Subscribes to the previews of the topic's sensor: the daemon makes previews only for a subscription to their full
  /// topic, which contains the sensor's name.
  void askForPreviews(std::string_view topic) {
    const std::size_t slash = topic.find('/', kTopicRoot.size());
    if (slash == std::string_view::npos) return;
    const std::string_view sensor = topic.substr(kTopicRoot.size(), slash - kTopicRoot.size());
    if (isValidName(sensor) && sensors.emplace(sensor).second)
      socket.set(zmq::sockopt::subscribe, topicOf(sensor, "preview"));
  }

  /// Adds the gap in the topic's sequence to `lost`. A new boot id starts a new sequence.
  void countLosses(const std::string& topic, const Header& header) {
    auto& [boot, sequence] = seen[topic];
    if (boot == header.boot && sequence != 0 && header.sequence > sequence + 1) lost += header.sequence - sequence - 1;
    boot = header.boot;
    sequence = header.sequence;
  }

  /// Decodes the message in `parts`. Returns nothing if it is of an unwanted or unknown topic.
  std::optional<Message> take(std::int64_t now_ns) {
    Message message;
    std::string topic;
    if (options.mode == Mode::kLatest) {
      if (count != 1) throw Error(ErrorCode::kMalformed, endpoint + " sends a field in several parts");
      message = decode(kField, parts[0].to_string_view());
    } else {
      if (count == 1 && !startsWith(kTopics)) {
        throw Error(ErrorCode::kBadEndpoint,
                    endpoint + " has no topics; is it the endpoint 'latest' instead of 'stream'?");
      }
      topic = parts[0].to_string();
      if (!startsWith(kTopicRoot)) {
        throw Error(ErrorCode::kVersion, endpoint + " publishes " +
                                             printable(std::string_view(topic).substr(0, kLongestTopic)) +
                                             ", this library reads " + std::string(kTopicRoot));
      }
      if ((options.topics & kPreview) != 0) askForPreviews(topic);
      const unsigned kind = kindOf(topic);
      if ((kind & options.topics) == 0) return std::nullopt;
      if (count < 2) throw Error(ErrorCode::kMalformed, endpoint + " sends a topic without a message");
      message = decode(kind, parts[1].to_string_view());
    }
    Header& header = std::visit([](auto& any) -> Header& { return any.header; }, message);
    header.arrived_ns = now_ns;
    const std::uint64_t returns = sources.returns();
    if (!options.allSources && !sources.take(message, now_ns)) return std::nullopt;
    if (sources.returns() != returns)
      socket.set(zmq::sockopt::subscribe, subscription);  // the other's description came
    if (options.mode == Mode::kStream) countLosses(topic, header);
    if (auto* contacts = std::get_if<Contacts>(&message)) {
      Touch& touch = touches[topic];
      touch.heard_ns = now_ns;
      touch.contacts.complete(*contacts);
    }
    return message;
  }

  /// One topic of contacts.
  struct Touch {
    PairedContacts contacts;
    std::int64_t heard_ns = 0;
  };

  SubscriberOptions options;
  std::vector<std::string> endpoints;  ///< connected to
  std::set<std::string> ofTouch;       ///< those of traction-touch beside a daemon's
  std::string endpoint;                ///< named in messages
  std::string_view subscription;       ///< beginning of the wanted messages
  std::uint64_t lost = 0;
  std::set<std::string> sensors;                             ///< sensors whose previews are subscribed to
  std::map<std::string, std::pair<Id, std::uint64_t>> seen;  ///< topic -> boot id and sequence of its last message
  std::map<std::string, Touch> touches;                      ///< by topic
  Sources sources;
  bool isSilent = false;  ///< next() found contacts of which nothing was heard for kTouchSilence_ns
  std::array<zmq::message_t, 3> parts;
  std::size_t count = 0;
  zmq::context_t context{1};
  zmq::socket_t socket{context, zmq::socket_type::sub};
  zmq::socket_t monitor{context, zmq::socket_type::pair};
  std::optional<Handshake> handshake;
  std::optional<Error> refusal;                 ///< not thrown yet
  std::set<std::string> connections;            ///< endpoints with a publisher
  std::optional<std::int64_t> unheardSince_ns;  ///< newest connection, or last subscription, before any message [ns]
  std::map<std::string, std::int64_t> givenUp;  ///< endpoint -> when to connect again [ns]
};

Subscriber::Subscriber(const SubscriberOptions& options) try
    : impl_(std::make_unique<Impl>(options)) {
} catch (const zmq::error_t& error) {
  throw noConnection(options.endpoint.empty() ? "tractiond " + options.instance : options.endpoint, error);
}
Subscriber::~Subscriber() = default;
Subscriber::Subscriber(Subscriber&&) noexcept = default;
Subscriber& Subscriber::operator=(Subscriber&&) noexcept = default;

std::optional<Message> Subscriber::receive(std::chrono::milliseconds timeout) try {
  constexpr int kMostPassedOver = 100;  // messages of other topics after the timeout
  const Clock::time_point end = endAfter(timeout);
  for (int passedOver = 0; passedOver < kMostPassedOver;) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - Clock::now());
    if (!impl_->next(std::max(left, std::chrono::milliseconds(0)))) {
      if (!impl_->isSilent) break;
      for (zmq::message_t& part : impl_->parts) part.rebuild();
      return impl_->endContacts(impl_->options.monotonicClock());
    }
    if (auto message = impl_->take(impl_->options.monotonicClock())) return message;
    if (left <= std::chrono::milliseconds(0)) ++passedOver;
  }
  for (zmq::message_t& part : impl_->parts) part.rebuild();
  return std::nullopt;
} catch (const zmq::error_t& error) {
  throw noConnection(impl_->endpoint, error);
}

Raw Subscriber::raw() const {
  if (impl_->options.mode == Mode::kLatest) return {{}, impl_->parts[0].to_string_view()};
  return {impl_->parts[0].to_string_view(), impl_->parts[1].to_string_view()};
}

const std::string& Subscriber::secondSource() const {
  return impl_->sources.trouble();
}

std::uint64_t Subscriber::lost() const {
  return impl_->lost;
}

bool Subscriber::isConnected() const {
  impl_->takeEvents();
  return std::any_of(impl_->connections.begin(), impl_->connections.end(),
                     [this](const std::string& each) { return !impl_->ofTouch.contains(each); });
}

const std::string& Subscriber::endpoint() const {
  return impl_->endpoint;
}

}  // namespace traction
