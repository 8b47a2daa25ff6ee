#include "gateway/relay.h"

#include "base/directory.h"
#include "base/network/socket.h"
#include "gateway/keys.h"
#include "gateway/rates.h"
#include "gateway/request.h"
#include "proto/traction/v1/endpoints.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>
#include <optional>
#include <set>
#include <string_view>
#include <thread>
#include <utility>

namespace tractiond::gateway {
namespace {

using network::property;
using network::put;
using network::receive;
using std::chrono::milliseconds;

constexpr int kMessagesPerTurn = 64;
constexpr int kSubscriptionsPerTurn = 256;
/// The instrument's time between descriptions to new subscribers.
constexpr std::int64_t kDescriptions_ns = 100'000'000;
constexpr std::size_t kMostTopics = 16;              ///< topics whose description is kept; an instrument has one
constexpr std::int64_t kKeys_ns = 250'000'000;       ///< between two checks of the keys
constexpr std::int64_t kSilence_ns = 3'000'000'000;  ///< three statuses
constexpr std::int64_t kUnheard_ns = 1'000'000'000;  ///< without a latest field until it is subscribed to again
constexpr int kWaitingForInstrument = 256;
constexpr std::string_view kDescriptionEnds = "/description/", kPreviewEnds = "/preview/";
constexpr std::string_view kFieldBegins = "\x09";  ///< Protobuf key of Field.timestamp

/// Queues [to][empty][body], whole or not at all, without waiting. Returns whether it was queued: network::put().
bool putAddressed(zmq::socket_t& socket, std::string_view to, zmq::message_t body) {
  zmq::message_t address(to.data(), to.size()), empty;
  return put(socket, address, true) && put(socket, empty, true) && put(socket, body, false);
}

/// Routing text that the instrument returns with its reply, so that the reply finds the client.
struct Route {
  std::string peer;              ///< routing id of the client's connection on the front's control socket
  std::uint32_t generation = 0;  ///< opening of the front to which the connection belongs

  /// Returns the route as bytes, from which of() restores it.
  std::string text() const { return peer + std::string(reinterpret_cast<const char*>(&generation), sizeof generation); }
  /// Restores a route. Returns nothing if the text is too short; nothing else is checked.
  static std::optional<Route> of(std::string_view text) {
    Route route;
    if (text.size() < sizeof route.generation) return std::nullopt;
    const std::size_t end = text.size() - sizeof route.generation;
    std::memcpy(&route.generation, text.data() + end, sizeof route.generation);
    route.peer = text.substr(0, end);
    return route;
  }
};

}  // namespace

struct Relay::Impl {
  Impl(const Config& given, const std::filesystem::path& instrument, Clock monotonicClock)
      : config(given)
      , clock(monotonicClock)
      , directory(instrument)
      , keys(given.keys)
      , requests(given.limits.requestsPerSecond, given.limits.requestsPerSecondEach)
      , heard_ns(clock())
      , latest_ns(heard_ns) {
    const traction::Endpoints endpoints = traction::ipcEndpoints(instrument);
    for (zmq::socket_t* socket : {&stream, &latest, &control}) socket->set(zmq::sockopt::linger, 0);
    latest.connect(endpoints.latest);
    latest.set(zmq::sockopt::subscribe, kFieldBegins);
    stream.connect(endpoints.stream);
    const std::filesystem::path touch = traction::touchDirectoryBeside(instrument);
    if (!touch.empty() && !canOthersControl(touch)) stream.connect(traction::ipcEndpoints(touch).stream);
    stream.set(zmq::sockopt::subscribe, traction::kTopicRoot);
    // A request that is sent while no instrument runs must not be carried out when one starts.
    control.set(zmq::sockopt::immediate, true);
    control.set(zmq::sockopt::sndhwm, kWaitingForInstrument);
    control.set(zmq::sockopt::rcvhwm, 0);
    control.connect(endpoints.control);
  }

  tl::expected<void, Error> openFront() {
    const auto mayEnter = [this](const std::string& key) {
      refreshKeys();
      return keys.find(key);
    };
    const auto refused = [this](const std::string& what) {
      if (const std::string line = refusals.next(what, clock()); !line.empty()) spdlog::warn("{}", line);
    };
    auto opened = Front::open(options, mayEnter, refused);
    if (!opened) return tl::unexpected(opened.error());
    front = *std::move(opened);
    ++generation;
    previewSubscriptions.clear();
    askForPreviews();
    items.clear();
    for (zmq::socket_t* socket : {&stream, &latest, &control}) items.push_back(network::readable(*socket));
    for (const Way way : {kStream, kControl, kPreview}) items.push_back(network::readable((*front)[way]));
    items.push_back(front->handshakes());
    return {};
  }

  /// Waits up to 300 ms for a running instrument, so that the first request finds it.
  void waitForInstrument() {
    constexpr milliseconds kMoment(300);
    zmq_pollitem_t item{control.handle(), 0, ZMQ_POLLOUT, 0};
    zmq_poll(&item, 1, kMoment.count());
  }

  /// Logs the allowed keys once the sockets are open.
  void tellWhoMayEnter() {
    if (options.server) {
      keys.refresh();
      tellKeys();
    } else if (config.insecure) {
      spdlog::warn("nobody is asked for a key, as gateway.insecure = true wants it");
    } else {
      spdlog::warn("nobody is asked for a key: there is none in {}; other hosts do not reach this gateway",
                   config.keys);
    }
  }

  void tellKeys() {
    for (const Error& fault : keys.faults()) spdlog::warn("{}", fault.message());
    spdlog::info("allowed: {}", listed(keys.keys()));
  }

  void refreshKeys() {
    if (!options.server) return;
    const std::vector<network::AllowedKey> before = keys.keys();
    if (!keys.refresh()) return;
    tellKeys();
    toCut = toCut || losesSomething(before, keys.keys());
  }

  /// Ends all connections; clients that are still allowed reconnect by themselves.
  tl::expected<void, Error> reopen() {
    constexpr int kTries = 100;
    constexpr milliseconds kPause(10);
    toCut = false;
    spdlog::info("a key was taken back: all connections are ended, and those still allowed come again");
    for (std::size_t way = 0; way < kWays; ++way) options.endpoints[way] = front->bound(static_cast<Way>(way));
    front.reset();
    tl::expected<void, Error> opened;
    for (int i = 0; i < kTries; ++i) {
      opened = openFront();
      if (opened || opened.error().exitCode != EX_UNAVAILABLE) break;
      std::this_thread::sleep_for(kPause);
    }
    return opened;
  }

  void passStream() {
    for (int i = 0; i < kMessagesPerTurn; ++i) {
      const std::size_t count = receive(stream, parts);
      if (count == 0) return;
      heard_ns = clock();
      if (silent.exchange(false)) spdlog::info("the instrument is heard again");
      if (count != 3) continue;  // not from a tractiond
      keepDescription();
      // Previews need network::Permission::kControl.
      const Way way = parts[0].to_string_view().ends_with(kPreviewEnds) ? kPreview : kStream;
      for (std::size_t part = 0; part < 3; ++part) put((*front)[way], parts[part], part < 2);
    }
  }

  /// The instrument makes previews only for subscriptions to a full topic.
  void askForPreviews() {
    if (previewSubscriptions.empty()) {
      for (const std::string& topic : previews) stream.set(zmq::sockopt::unsubscribe, topic);
      previews.clear();
      return;
    }
    for (const auto& [topic, kept] : descriptions) {
      const std::string preview = topic.substr(0, topic.size() - kDescriptionEnds.size()) + std::string(kPreviewEnds);
      if (previews.insert(preview).second) stream.set(zmq::sockopt::subscribe, preview);
    }
  }

  /// Reads subscriptions to previews.
  void takePreviewSubscriptions() {
    for (int i = 0; i < kSubscriptionsPerTurn && receive((*front)[kPreview], parts) != 0; ++i) {
      const std::string text = parts[0].to_string();
      if (text.starts_with('\1')) previewSubscriptions.insert(text.substr(1));
      if (text.starts_with('\0')) previewSubscriptions.erase(text.substr(1));
    }
    askForPreviews();
  }

  void keepDescription() {
    const std::string_view topic = parts[0].to_string_view();
    if (!topic.ends_with(kDescriptionEnds)) return;
    auto kept = descriptions.find(topic);
    if (kept == descriptions.end()) {
      if (descriptions.size() >= kMostTopics) return;
      kept = descriptions.emplace(topic, std::array<zmq::message_t, 3>()).first;
    }
    for (std::size_t part = 0; part < 3; ++part) kept->second[part].copy(parts[part]);
  }

  /// Sends the descriptions to new subscribers, which join in the middle of the stream.
  void takeSubscriptions(std::int64_t now) {
    for (int i = 0; i < kSubscriptionsPerTurn && receive((*front)[kStream], parts) != 0; ++i) {
      const std::string_view text = parts[0].to_string_view();
      if (!text.starts_with('\1')) continue;
      for (const auto& [topic, kept] : descriptions) {
        descriptionDue = descriptionDue || std::string_view(topic).starts_with(text.substr(1));
      }
    }
    if (!descriptionDue || now - described_ns < kDescriptions_ns) return;
    descriptionDue = false;
    described_ns = now;
    for (auto& [topic, kept] : descriptions) {
      for (std::size_t part = 0; part < 3; ++part) {
        zmq::message_t copy;
        copy.copy(kept[part]);
        put((*front)[kStream], copy, part < 2);
      }
    }
  }

  /// Passes on the newest field. Skips older ones itself: ZeroMQ 4.3.4 aborts the process if a message in parts reaches
  /// a socket with ZMQ_CONFLATE.
  void passLatest() {
    zmq::message_t newest;
    bool isThere = false;
    for (int i = 0; i < kMessagesPerTurn; ++i) {
      const std::size_t count = receive(latest, parts);
      if (count == 0) break;
      if (count != 1) continue;  // not from a tractiond
      newest.swap(parts[0]);
      isThere = true;
    }
    if (!isThere) return;
    latest_ns = clock();
    put((*front)[kLatest], newest, false);
  }

  /// Subscribes again if no field was received for a second: the instrument's socket conflates what it receives, too,
  /// and its ZeroMQ may drop a subscription.
  void subscribeAgain(std::int64_t now) {
    if (now - latest_ns < kUnheard_ns) return;
    latest.set(zmq::sockopt::subscribe, kFieldBegins);
    latest_ns = now;
  }

  void passRequests(std::int64_t now) {
    for (int i = 0; i < kMessagesPerTurn; ++i) {
      const std::size_t count = receive((*front)[kControl], parts);
      if (count == 0) return;
      // [peer][empty][request]
      if (count != 3 || !parts[1].empty()) continue;
      const std::string why = pass(parts[0].to_string_view(), parts[2], now);
      if (!why.empty()) putAddressed((*front)[kControl], parts[0].to_string_view(), zmq::message_t(errorReply(why)));
    }
  }

  /// Forwards a request.
  /// \return why it was not forwarded; empty: it was
  std::string pass(std::string_view peer, zmq::message_t& request, std::int64_t now) {
    const std::string user = options.server ? property(request, "User-Id") : "",
                      address = property(request, "Peer-Address");
    const std::string& who = user.empty() ? address : user;
    if (const int limit = requests.beyond(who, now); limit > 0) {
      return "too many requests: more than " + std::to_string(limit) + " in a second";
    }
    const auto stated = signedRequest(
        request.to_string_view(), (user.empty() ? "somebody without a key" : "\"" + user + "\"") + " at " + address);
    if (!stated) return stated.error();
    const Route route{std::string(peer), generation};
    if (putAddressed(control, route.text(), zmq::message_t(*stated))) return "";
    return "no instrument is there; is tractiond running?";
  }

  void passReplies() {
    for (int i = 0; i < kMessagesPerTurn; ++i) {
      const std::size_t count = receive(control, parts);
      if (count == 0) return;
      // [route][empty][reply]
      const std::optional<Route> route = Route::of(parts[0].to_string_view());
      if (count != 3 || !route || route->generation != generation) continue;
      putAddressed((*front)[kControl], route->peer, std::move(parts[2]));
    }
  }

  /// Does the periodic work: checks keys and the subscription to latest, and logs what changed.
  void doPeriodicWork(std::int64_t now) {
    if (now - checked_ns < kKeys_ns) return;
    checked_ns = now;
    refreshKeys();
    subscribeAgain(now);
    if (!silent && now - heard_ns > kSilence_ns) {
      silent = true;
      spdlog::warn("nothing comes from the instrument in {}; is tractiond running?", directory.string());
    }
  }

  Config config;
  Clock clock;
  std::filesystem::path directory;
  network::KeyDirectory keys;
  Front::Options options;
  std::unique_ptr<Front> front;
  std::uint32_t generation = 0;  ///< number of openings of the front
  bool toCut = false;
  std::vector<zmq_pollitem_t> items;
  std::array<zmq::message_t, 4> parts;
  std::map<std::string, std::array<zmq::message_t, 3>, std::less<>> descriptions;  ///< topic -> last description
  std::set<std::string> previewSubscriptions;  ///< topics at the front's preview socket
  std::set<std::string> previews;              ///< subscribed preview topics
  bool descriptionDue = false;
  std::int64_t described_ns = 0;
  RequestLimit requests;
  SeldomLine refusals;
  std::int64_t heard_ns, latest_ns, checked_ns = 0;
  std::atomic<bool> silent{false};

  zmq::context_t context{1};  ///< separate from the front's context: peers cannot affect the instrument's side
  zmq::socket_t stream{context, zmq::socket_type::sub};
  zmq::socket_t latest{context, zmq::socket_type::sub};
  zmq::socket_t control{context, zmq::socket_type::dealer};
};

Relay::Relay(std::unique_ptr<Impl> impl)
    : impl_(std::move(impl)) {}

Relay::~Relay() = default;

tl::expected<std::unique_ptr<Relay>, Error> Relay::open(const Config& config, const std::filesystem::path& instrument,
                                                        Clock monotonicClock) try {
  auto server = serverKey(config);
  if (!server) return tl::unexpected(server.error());
  auto impl = std::make_unique<Impl>(config, instrument, monotonicClock);
  impl->options = {.endpoints = {config.stream, config.latest, config.control, config.preview},
                   .server = *std::move(server),
                   .highWaterMark = config.highWaterMark};
  impl->waitForInstrument();
  if (auto opened = impl->openFront(); !opened) return tl::unexpected(opened.error());
  impl->tellWhoMayEnter();
  return std::unique_ptr<Relay>(new Relay(std::move(impl)));
} catch (const zmq::error_t& error) {
  return tl::unexpected(Error{EX_OSERR, std::string("ZeroMQ cannot start: ") + error.what(), "", ""});
}

tl::expected<void, Error> Relay::turn(milliseconds timeout) {
  Impl& self = *impl_;
  const long wait = self.descriptionDue ? 10 : timeout.count();
  zmq_poll(self.items.data(), static_cast<int>(self.items.size()), wait);
  const std::int64_t now = self.clock();
  self.passLatest();
  self.passStream();
  self.passReplies();
  self.front->serve();
  self.takeSubscriptions(now);
  self.takePreviewSubscriptions();
  self.passRequests(now);
  self.doPeriodicWork(now);
  return self.toCut ? self.reopen() : tl::expected<void, Error>();
}

const std::vector<std::string>& Relay::bound(Way way) const {
  return impl_->front->bound(way);
}

bool Relay::isSilent() const {
  return impl_->silent;
}

}  // namespace tractiond::gateway
