// One message is encoded straight into ZeroMQ's memory and shared by both sockets and all their subscribers.

#include "daemon/publish/publisher.h"

#include "base/loan.h"
#include "base/network/socket.h"
#include "daemon/publish/durations.h"
#include "daemon/publish/wire.h"
#include "daemon/publish/wire_parts.h"
#include "proto/traction/v1/endpoints.h"
#include "traction/v1/status.pb.h"

#include <google/protobuf/message_lite.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cassert>
#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <mutex>
#include <set>

namespace tractiond::publish {

namespace {

/// A subscription is a topic's beginning; without CURVE nothing longer comes from an honest peer.
constexpr std::int64_t kLargestSubscription = 64;
/// Subscriptions looked at in one turn, so that a flood of them does not keep a field waiting.
constexpr int kSubscriptionsPerTurn = 256;

/// Previews that wait for slow subscribers, of all together: one that reads too slowly fills no memory.
constexpr int kWaitingPreviews = 64;

enum Topic : std::size_t { kField, kMarkers, kDescription, kStatus, kPreview, kTopicCount };
constexpr std::array<const char*, kTopicCount> kKinds = {"field", "markers", "description", "status", "preview"};

/// Encodes a message into ZeroMQ's memory.
zmq::message_t packed(const google::protobuf::MessageLite& message) {
  zmq::message_t bytes(message.ByteSizeLong());
  message.SerializeWithCachedSizesToArray(bytes.data<std::uint8_t>());
  return bytes;
}

/// Returns "1700000000.123456789".
zmq::message_t timeText(std::int64_t ns) {
  std::array<char, 32> text{};
  constexpr std::int64_t kSecond = 1'000'000'000;
  const int size = std::snprintf(text.data(), text.size(), "%" PRId64 ".%09" PRId64, ns / kSecond, ns % kSecond);
  return {text.data(), static_cast<std::size_t>(size)};
}

}  // namespace

struct Publisher::Impl {
  /// Frees an encoded preview, which ZeroMQ reads where it is. Called by ZeroMQ's thread when nobody waits for it any
  /// more.
  /// \param waiting waitingPreviews
  static void freePreview(void* bytes, void* waiting) {
    delete[] static_cast<std::uint8_t*>(bytes);
    static_cast<std::atomic<int>*>(waiting)->fetch_sub(1, std::memory_order_relaxed);  // a count: it orders nothing
  }

  struct PreviewToSend {
    zmq::message_t message;
    std::int64_t real_ns = 0;
  };

  Impl(const PublishOptions& given, const Description& described, const Ledger& account, Measure ask)
      : options(given)
      , ledger(account)
      , measure(std::move(ask))
      , identity(described.identity)
      , wire(described.identity)
      , started_ns(given.monotonicClock()) {
    for (std::size_t i = 0; i < kTopicCount; ++i) topics[i] = traction::topicOf(identity.sensor, kKinds[i]);
    network::guard(stream, options.highWaterMark, kLargestSubscription);
    stream.set(zmq::sockopt::xpub_verbose, true);  // each new subscriber is seen, and the last one's leaving
    network::guard(latest, options.highWaterMark, kLargestSubscription);
    latest.set(zmq::sockopt::conflate, true);
    lastStatus_ns = started_ns;
    lastStatus.reserve(4096);  // its numbers grow
  }

  ~Impl() {
    delete offered.load();
    network::release(streamEndpoints);
    network::release(latestEndpoints);
  }

  void send(Topic topic, zmq::message_t& message, std::int64_t real_ns) {
    // Without a function to free it ZeroMQ reads the topic where it is.
    zmq::message_t name(topics[topic].data(), topics[topic].size(), nullptr);
    zmq::message_t time = timeText(real_ns);
    // A full pipe loses the message.
    network::put(stream, name, true);
    network::put(stream, message, true);
    network::put(stream, time, false);
  }

  /// Returns a heading with the present time.
  Heading headingNow(Heading heading = {}) const {
    heading.sent_ns = options.monotonicClock();
    heading.sentReal_ns = options.realClock();
    return heading;
  }

  Heading headingOf(Topic topic) {
    Heading heading = headingNow(last);
    heading.sequence = ++sequences[topic];
    return heading;
  }

  void sendDescription() {
    const Heading heading = headingOf(kDescription);
    lastDescription_ns = heading.sent_ns;
    descriptionDue = false;
    encode(heading, *description);
    zmq::message_t message = packed(*description);
    send(kDescription, message, heading.sentReal_ns);
  }

  void sendStatus() {
    const Heading heading = headingOf(kStatus);
    const double interval_s = static_cast<double>(heading.sent_ns - lastStatus_ns) * 1e-9;
    const auto rate = [&](std::uint64_t now, std::uint64_t& before) {
      const auto count = static_cast<double>(now - std::exchange(before, now));
      return interval_s > 0.0 ? count / interval_s : 0.0;
    };
    traction::v1::Status& status = wire.status();
    status.set_uptime_s(static_cast<double>(heading.sent_ns - started_ns) * 1e-9);
    status.mutable_rates()->set_received_hz(rate(ledger.received.get(), receivedBefore));
    status.mutable_rates()->set_published_hz(rate(sequences[kField], publishedBefore));
    if (measure) measure(status);  // which goes by the rates
    status.set_residual_px(residuals == 0 ? 0.0 : std::sqrt(residualSquares_px2 / static_cast<double>(residuals)));
    status.mutable_solving()->CopyFrom(solving);
    residuals = 0;
    residualSquares_px2 = 0.0;
    track.take(*status.mutable_latencies()->mutable_track());
    solve.take(*status.mutable_latencies()->mutable_solve());
    toSend.take(*status.mutable_latencies()->mutable_send());
    total.take(*status.mutable_latencies()->mutable_total());
    lastStatus_ns = heading.sent_ns;

    zmq::message_t message = packed(wire.fillStatus(ledger, heading));
    // A reader in the way: it gets this one's predecessor, and nobody waits.
    if (const std::unique_lock lock(lastMutex, std::try_to_lock); lock.owns_lock()) {
      lastStatus.assign(message.data<char>(), message.size());
    }
    send(kStatus, message, heading.sentReal_ns);
  }

  void count(const TractionField& field) {
    const SolverWork& work = field.work;
    solving.set_contact(solving.contact() + (field.method == Method::kContact ? 1 : 0));
    solving.set_patches(solving.patches() + (work.patchShare > 0.5 ? 1 : 0));
    solving.set_even(solving.even() + (work.evenShare > 0.5 ? 1 : 0));
    solving.set_rounds(solving.rounds() + static_cast<std::uint64_t>(work.rounds));
    solving.set_atoms(solving.atoms() + static_cast<std::uint64_t>(work.atoms));
    solving.set_failed(solving.failed() + (work.failed ? 1 : 0));
  }

  void takeDescription() {
    if (offered.load(std::memory_order_relaxed) == nullptr) return;
    // acquire: partner is the release in describe(); the message is complete when its address is seen.
    if (auto* fresh = offered.exchange(nullptr, std::memory_order_acquire)) {
      description.reset(fresh);
      sendDescription();
    }
  }

  void readSubscriptions() {
    for (int i = 0; i < kSubscriptionsPerTurn; ++i) {
      zmq::message_t message;
      if (zmq_msg_recv(message.handle(), stream.handle(), ZMQ_DONTWAIT) < 0) return;
      const std::string_view text = message.to_string_view();
      notePreviews(text);
      if (!text.starts_with('\1')) continue;
      if (std::string_view(topics[kDescription]).starts_with(text.substr(1))) descriptionDue = true;
    }
  }

  /// Notes subscriptions to previews. A subscriber to all of a sensor, or more, gets previews while others want them,
  /// but is no reason to make any.
  void notePreviews(std::string_view message) {
    const std::string_view topic = topics[kPreview], wanted = message.substr(std::min<std::size_t>(1, message.size()));
    const std::size_t unnamed = topic.size() - std::char_traits<char>::length(kKinds[kPreview]) - 1;
    if (wanted.size() <= unnamed || !topic.starts_with(wanted)) return;
    if (message[0] == '\1')
      previewTopics.emplace(wanted);
    else
      previewTopics.erase(std::string(wanted));
    previewWanted.store(!previewTopics.empty(), std::memory_order_relaxed);  // a wish: it orders nothing
  }

  void sendPreview() {
    if (PreviewToSend* const one = preview.lent()) {
      send(kPreview, one->message, one->real_ns);
      preview.giveBack();
    }
  }

  static bool due(std::int64_t now, std::int64_t last_ns, std::chrono::milliseconds interval) {
    return now - last_ns >= std::chrono::nanoseconds(interval).count();
  }

  /// What is to be done besides fields.
  void serve() {
    takeDescription();
    readSubscriptions();
    sendPreview();
    const std::int64_t now = options.monotonicClock();
    if (descriptionDue && due(now, lastDescription_ns, options.descriptionInterval)) sendDescription();
    if (due(now, lastStatus_ns, options.statusInterval)) sendStatus();
  }

  PublishOptions options;
  const Ledger& ledger;
  Measure measure;
  Identity identity;
  Wire wire;
  std::array<std::string, kTopicCount> topics;
  std::array<std::uint64_t, kTopicCount> sequences{};
  Heading last;  ///< of the last field

  std::unique_ptr<traction::v1::Description> description;
  std::atomic<traction::v1::Description*> offered{nullptr};  ///< by describe()
  bool descriptionDue = false;
  std::int64_t lastDescription_ns = 0;

  const std::int64_t started_ns;
  std::int64_t lastStatus_ns = 0;
  std::uint64_t receivedBefore = 0;
  std::uint64_t publishedBefore = 0;
  Durations track, solve, toSend, total;
  std::uint64_t residuals = 0;  ///< in the sum
  double residualSquares_px2 = 0.0;
  traction::v1::Solving solving;  ///< sums over all fields

  std::set<std::string> previewTopics;  ///< beginnings of that topic with a subscriber
  std::atomic<bool> previewWanted{false};
  std::atomic<int> waitingPreviews{0};
  Loan<PreviewToSend> preview;

  mutable std::mutex lastMutex;  ///< guards the two below; the publishing thread never waits for it
  std::string lastStatus;
  std::string lastDescription;

  zmq::context_t context{1};
  zmq::socket_t stream{context, zmq::socket_type::xpub};
  zmq::socket_t latest{context, zmq::socket_type::pub};
  std::vector<std::string> streamEndpoints;
  std::vector<std::string> latestEndpoints;
};

Publisher::Publisher(std::unique_ptr<Impl> impl)
    : impl_(std::move(impl)) {}

Publisher::~Publisher() = default;

tl::expected<std::unique_ptr<Publisher>, Error> Publisher::open(const PublishOptions& options,
                                                                const Description& description, const Ledger& ledger,
                                                                Measure measure) try {
  assert(traction::isValidName(description.identity.sensor));
  auto impl = std::make_unique<Impl>(options, description, ledger, std::move(measure));
  for (auto [socket, endpoints, bound] : {std::tuple(&impl->stream, &options.stream, &impl->streamEndpoints),
                                          std::tuple(&impl->latest, &options.latest, &impl->latestEndpoints)}) {
    auto result = network::bind(*socket, *endpoints);
    if (!result) return tl::unexpected(result.error());
    *bound = *std::move(result);
  }
  std::unique_ptr<Publisher> publisher(new Publisher(std::move(impl)));
  publisher->describe(description);
  publisher->impl_->takeDescription();
  publisher->impl_->sendStatus();
  return publisher;
} catch (const zmq::error_t& error) {
  return tl::unexpected(Error{EX_OSERR, std::string("ZeroMQ cannot start: ") + error.what(), "", ""});
}

void Publisher::publish(const TractionField& field) {
  Impl& self = *impl_;
  const FrameTimes& times = field.markers.info.times;
  self.last.frame = field.markers.info;
  self.last.flags = field.flags;
  self.last.zero = field.markers.zero;

  const Heading heading = self.headingOf(kField);
  zmq::message_t forStream = packed(self.wire.fill(field, heading));
  zmq::message_t forLatest;
  forLatest.copy(forStream);
  self.send(kField, forStream, times.receivedReal_ns);
  network::put(self.latest, forLatest, false);

  Heading ofMarkers = self.headingOf(kMarkers);
  ofMarkers.flags = field.markers.flags;
  zmq::message_t markers = packed(self.wire.fill(field.markers, ofMarkers));
  self.send(kMarkers, markers, times.receivedReal_ns);

  self.count(field);
  ++self.residuals;
  self.residualSquares_px2 += field.residual_px * field.residual_px;
  self.track.add(times.tracked_ns - times.received_ns);
  self.solve.add(times.solved_ns - times.tracked_ns);
  self.toSend.add(heading.sent_ns - times.solved_ns);
  self.total.add(heading.sent_ns - times.received_ns);
  self.serve();
}

void Publisher::serve(int fd, std::chrono::milliseconds timeout) {
  Impl& self = *impl_;
  const std::int64_t now = self.options.monotonicClock();
  const auto until = [&](std::int64_t last_ns, std::chrono::milliseconds interval) {
    const auto left = std::chrono::nanoseconds(last_ns - now) + interval;
    return std::max(std::chrono::ceil<std::chrono::milliseconds>(left), std::chrono::milliseconds(0));
  };
  timeout = std::min(timeout, until(self.lastStatus_ns, self.options.statusInterval));
  if (self.descriptionDue) {
    timeout = std::min(timeout, until(self.lastDescription_ns, self.options.descriptionInterval));
  }
  std::array<zmq_pollitem_t, 2> items = {{network::readable(self.stream), {nullptr, fd, ZMQ_POLLIN, 0}}};
  zmq_poll(items.data(), fd < 0 ? 1 : 2, timeout.count());
  self.serve();
}

void Publisher::describe(const Description& description) {
  Impl& self = *impl_;
  auto message = std::make_unique<traction::v1::Description>(description.message);
  encode(self.identity, *message->mutable_header());
  for (const std::string& topic : self.topics) message->add_topics(topic);
  encode(self.headingNow(), *message);
  {
    const std::lock_guard lock(self.lastMutex);
    self.lastDescription = message->SerializeAsString();
  }
  // release: partner is the acquire in takeDescription(). What had not been taken yet is out of date.
  delete self.offered.exchange(message.release(), std::memory_order_acq_rel);
}

bool Publisher::previewWanted() const {
  return impl_->previewWanted.load(std::memory_order_relaxed);
}

bool Publisher::offerPreview(const Preview& preview) {
  Impl& self = *impl_;
  Impl::PreviewToSend* const next = self.preview.own();
  if (!next || self.waitingPreviews.load(std::memory_order_relaxed) >= kWaitingPreviews) return false;
  Heading heading = self.headingNow();
  heading.sequence = ++self.sequences[kPreview];
  const google::protobuf::MessageLite& message = self.wire.fill(preview, heading);
  const std::size_t size = message.ByteSizeLong();
  auto bytes = std::make_unique_for_overwrite<std::uint8_t[]>(size);
  message.SerializeWithCachedSizesToArray(bytes.get());
  next->message = zmq::message_t(bytes.get(), size, Impl::freePreview, &self.waitingPreviews);
  bytes.release();
  self.waitingPreviews.fetch_add(1, std::memory_order_relaxed);
  next->real_ns = preview.info.times.receivedReal_ns;
  self.preview.lend();
  return true;
}

std::string Publisher::lastStatus() const {
  const std::lock_guard lock(impl_->lastMutex);
  return impl_->lastStatus;
}

std::string Publisher::lastDescription() const {
  const std::lock_guard lock(impl_->lastMutex);
  return impl_->lastDescription;
}

const std::vector<std::string>& Publisher::streamEndpoints() const {
  return impl_->streamEndpoints;
}
const std::vector<std::string>& Publisher::latestEndpoints() const {
  return impl_->latestEndpoints;
}

}  // namespace tractiond::publish
