#include "tests/simulation/gateway/peers.h"

#include "traction/v1/control.pb.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace tractiond::simulation {
namespace {

constexpr std::int64_t kPause_ns = 200 * kMs;      // until a peer connects again
constexpr std::int64_t kKeys_ns = 500 * kMs;       // in which a gateway has noticed a change of the keys
constexpr std::int64_t kAdmitted_ns = 1200 * kMs;  // from the first try to connect
constexpr int kUnknown = 50;                       // a key that the gateway has not

}  // namespace

struct RemotePeers::One : Peer {
  One(RemotePeers& others, Way toWay, int ownKey, std::string from, std::int64_t until)
      : all(others)
      , way(toWay)
      , key(ownKey)
      , address(std::move(from))
      , until_ns(until) {}

  void heed(std::span<const std::string_view> parts, std::uint64_t /*number*/) override {
    all.journal_.law(all.mayBeAdmitted(*this), "a refused client receives nothing", [this] { return text(); });
    if (way == Way::kControl) return heedAnswer(parts);
    ++all.journal_.result.delivered;
    const auto found = std::ranges::find_if(kPublished, [&](const char* kind) {
      return parts.size() == 3 && parts[0].find(fmt::format("/{}/", kind)) != std::string_view::npos;
    });
    const std::size_t kind = parts.size() == 1 ? 0 : static_cast<std::size_t>(found - kPublished.begin());
    const std::string_view body = parts[parts.size() == 1 ? 0 : 1];
    all.journal_.law(kind < kPublished.size() && body.starts_with('\x09'), "subscribers understand what is sent",
                     [&] { return fmt::format("{} parts", parts.size()); });
    const std::uint64_t number = std::stoull(std::string(body.substr(1)));
    std::uint64_t& before = numbers[kind];
    const bool isRepeated = kind == static_cast<std::size_t>(Published::kDescription) && number == before;
    all.journal_.law(before == 0 || number > before || isRepeated, "nothing is sent twice or out of order",
                     [&] { return fmt::format("{} {} after {}", kPublished.at(kind), number, before); });
    const bool losesNothing = reads_bytesPerMs == kAtOnce && way == Way::kStream && kind == 0 && before > 0 &&
                              joined_ns > all.instrument_.changed_ns() && all.instrument_.isThere();
    all.journal_.law(!losesNothing || number == before + 1, "a subscriber that keeps up loses nothing",
                     [&] { return fmt::format("{} after {}", number, before); });
    before = number;
    came_ns[kind] = now();
  }

  void heedAnswer(std::span<const std::string_view> parts) {
    traction::v1::Reply reply;
    const bool isRead = parts.size() == 2 && parts[0].empty() &&
                        reply.ParseFromArray(parts[1].data(), static_cast<int>(parts[1].size()));
    const std::string& said = reply.error();
    const bool isOfGateway = said.starts_with("too many re") || said.starts_with("no instrument is there");
    all.journal_.law(isRead && (isOfGateway || said.starts_with(who() + "#")),
                     "an answer reaches the client that asked", [&] { return text() + " is answered " + said; });
    all.journal_.law(open > 0, "each request gets exactly one answer", [&] { return "one more: " + said; });
    --open;
    ++all.journal_.result.answers;
  }

  network::Permission needs() const {
    return way == Way::kControl || way == Way::kPreview ? network::Permission::kControl : network::Permission::kRead;
  }
  /// Returns how a gateway names the client.
  std::string who() const {
    return fmt::format("\"{}\" at {}", key < Keys::kCount ? Keys::kNames.at(static_cast<std::size_t>(key)) : "",
                       address);
  }
  std::string text() const {
    return fmt::format("{}, key {}, at port {}", address, key, kRemotePorts.at(static_cast<std::size_t>(way)));
  }

  RemotePeers& all;
  Way way;
  int key;  ///< of Keys; -1: it has none
  std::string address;
  std::int64_t until_ns;
  std::int64_t reads_bytesPerMs = kAtOnce;
  std::vector<std::string> topics;
  bool isSilent = false;
  bool wantsFields = false;     ///< its topics are such
  std::int64_t asksAtOnce = 0;  ///< requests that it sends when it has connected
  std::int64_t asksEach_ns = 0, toggles_ns = 0;
  int fd = -1;
  std::int64_t joins_ns = now(), joined_ns = 0, out_ns = now(), next_ns = kNever;
  std::array<std::uint64_t, kPublished.size()> numbers{};  ///< of the last message; 0: none yet
  std::array<std::int64_t, kPublished.size()> came_ns{};
  std::int64_t open = 0, mayLack = 0, asked_ns = 0, asked = 0;
  int toggled = 0;
  bool wantsPreviews = false;
};

RemotePeers::RemotePeers(Bus& bus, const Keys& keys, const Instrument& instrument, const Starvation& starvation,
                         Journal& journal)
    : bus_(bus)
    , keys_(keys)
    , instrument_(instrument)
    , starvation_(starvation)
    , journal_(journal) {
  add(Way::kStream, 0, "192.0.2.1", kNever).topics = {"traction/v1/"};
  add(Way::kLatest, 0, "192.0.2.1", kNever).topics = {""};
  add(Way::kControl, 1, "192.0.2.2", kNever).asksEach_ns = kSecond;
}

RemotePeers::~RemotePeers() = default;

RemotePeers::One& RemotePeers::add(Way way, int key, std::string address, std::int64_t until_ns) {
  all_.push_back(std::make_unique<One>(*this, way, key, std::move(address), until_ns));
  next_ns_ = now();
  return *all_.back();
}

void RemotePeers::heed(const Happening& one) {
  const std::int64_t until_ns = now() + one.for_ms * kMs;
  const int arrival = ++arrivals_;
  const auto address = [arrival](std::int64_t i) {
    return fmt::format("10.{}.{}.{}", arrival % 250, i / 200, i % 200);
  };
  switch (one.event) {
  case Event::kRemoteSubscribers:
    for (std::int64_t i = 0; i < one.amount; ++i)
      add(Way::kStream, i % 2 == 0 ? 0 : 1, address(i / 8), until_ns).topics = {topicOf(Published::kField),
                                                                                topicOf(Published::kDescription)};
    break;
  case Event::kRemoteSlow: {
    One& slow = add(Way::kStream, 0, "192.0.2.3", until_ns);
    slow.topics = {"traction/v1/"};
    slow.reads_bytesPerMs = one.amount;
    break;
  }
  case Event::kRemoteRequests:
  case Event::kRemoteUnread: {
    One& client = add(Way::kControl, arrival % 2 == 0 ? 1 : 2, "192.0.2.5", until_ns);
    client.asksAtOnce = one.amount;
    if (one.event == Event::kRemoteUnread) client.reads_bytesPerMs = kReadsNothing;
    break;
  }
  case Event::kRemotePreviews: {
    One& watcher = add(Way::kPreview, 2, "192.0.2.6", until_ns);
    watcher.toggles_ns = one.amount * kMs;
    break;
  }
  case Event::kStrangers:
    for (std::int64_t i = 0; i < one.amount; ++i) {
      const auto kind = (i + arrival) % 4;
      One& stranger = add(kind == 1 || kind == 2 ? Way::kControl : Way::kStream,
                          kind == 1   ? kUnknown
                          : kind == 2 ? 0
                                      : -1,
                          "192.0.2.7", until_ns);
      stranger.isSilent = kind == 3;
      stranger.asksAtOnce = stranger.way == Way::kControl ? 1 : 0;
      if (stranger.way == Way::kStream) stranger.topics = {"traction/v1/"};
    }
    break;
  default:
    return;
  }
  findNext();
}

void RemotePeers::begin() {
  listens_ = true;
  listens_ns_ = now();
  for (const auto& one : all_) one->joins_ns = std::max(one->joins_ns, now());
  findNext();
}

void RemotePeers::die() {
  listens_ = false;
  for (const auto& one : all_) leave(*one);
  findNext();
}

void RemotePeers::loseRequests() {
  for (const auto& one : all_) one->mayLack = one->open;
}

void RemotePeers::leave(One& one) {
  if (one.fd < 0) return;
  if (one.way == Way::kPreview) previewsChanged_ns_ = now();
  bus_.disconnect(std::exchange(one.fd, -1));
  one.wantsPreviews = false;
  one.open = one.mayLack = 0;
  one.numbers = {};
  one.next_ns = kNever;
  one.joins_ns = now() + kPause_ns;
}

void RemotePeers::connect(One& one) {
  one.joined_ns = now();
  one.came_ns.fill(now());
  const std::string key = one.key < 0 ? "" : Keys::bytesOf(one.key);
  one.fd = bus_.connect(kRemotePorts.at(static_cast<std::size_t>(one.way)), one, one.address, one.reads_bytesPerMs,
                        {key, one.isSilent});
  one.joins_ns = now() + kPause_ns;
  if (one.fd < 0) return;
  for (const std::string& topic : one.topics) {
    one.wantsFields = one.wantsFields || topicOf(Published::kField).starts_with(topic);
    bus_.send(one.fd, std::array{"\1" + topic});
  }
  if (one.asksAtOnce > 0) ask(one, one.asksAtOnce);
  if (one.asksEach_ns > 0) one.next_ns = now() + one.asksEach_ns;
  if (one.toggles_ns > 0) {
    one.toggled = 0;
    toggle(one);
  }
}

/// Sends requests that contain their client's name and address, which the instrument compares.
void RemotePeers::ask(One& one, std::int64_t number) {
  for (std::int64_t i = 0; i < number && !bus_.hasEnded(one.fd); ++i) {
    traction::v1::Request request;
    request.set_version(1);
    request.set_on_behalf_of("the administrator");
    request.mutable_camera()->mutable_read()->set_name(fmt::format("{}#{}", one.who(), ++one.asked));
    ++one.open;
    one.asked_ns = now();
    bus_.send(one.fd, std::array{std::string(), request.SerializeAsString()});
  }
}

/// Subscribes to previews, and cancels that in the next call.
void RemotePeers::toggle(One& one) {
  const bool wants = one.toggled++ % 2 == 0;
  one.next_ns = now() + one.toggles_ns;
  one.wantsPreviews = wants;
  previewsChanged_ns_ = now();
  bus_.send(one.fd, std::array{(wants ? '\1' : '\0') + topicOf(Published::kPreview)});
}

void RemotePeers::turn() {
  if (next_ns_ > now()) return;
  std::erase_if(all_, [this](const auto& one) {
    if (one->until_ns > now()) return false;
    leave(*one);
    return true;
  });
  for (const auto& one : all_) {
    if (one->fd >= 0 && bus_.hasEnded(one->fd)) leave(*one);
    if (one->fd < 0 && listens_ && one->joins_ns <= now()) connect(*one);
    if (one->fd < 0 || one->next_ns > now()) continue;
    if (one->toggles_ns > 0) {
      toggle(*one);
      continue;
    }
    one->next_ns = now() + one->asksEach_ns;
    ask(*one, 1);
  }
  findNext();
}

/// Peers look every 50 ms whether their connections have been ended.
void RemotePeers::findNext() {
  constexpr std::int64_t kLook_ns = 50 * kMs;
  next_ns_ = now() + kLook_ns;
  for (const auto& one : all_)
    next_ns_ = std::min({next_ns_, one->until_ns, one->next_ns, listens_ && one->fd < 0 ? one->joins_ns : kNever});
}

/// Returns whether the key of a peer allows what it wants.
bool RemotePeers::isAllowed(const One& one) const {
  const auto permission = keys_.permissionOf(one.key);
  return permission && !one.isSilent && *permission >= one.needs();
}

/// Returns the same, also if it was allowed and the gateway may not have noticed the change.
bool RemotePeers::mayBeAdmitted(const One& one) const {
  const bool isNever = one.isSilent || one.key < 0 || one.key >= Keys::kCount || Keys::usual(one.key) < one.needs();
  return isAllowed(one) || (!isNever && since(keys_.changed_ns(one.key)) <= kKeys_ns);
}

bool RemotePeers::mustBeAdmitted(const One& one) const {
  return listens_ && isAllowed(one);
}

void RemotePeers::checkOne(One& one) {
  constexpr std::int64_t kAnswered_ns = 5500 * kMs;  // the instrument takes up to 3 s
  const bool isAdmitted = one.fd >= 0 && bus_.isAdmitted(one.fd);
  if (isAdmitted || !mustBeAdmitted(one)) one.out_ns = now();
  journal_.law(since(one.out_ns) <= kAdmitted_ns, "an allowed client is admitted", [&] { return one.text(); });
  journal_.law(!isAdmitted || mayBeAdmitted(one), "only allowed clients are admitted", [&] { return one.text(); });
  journal_.law(one.fd < 0 || isAdmitted || bus_.hasEnded(one.fd) || since(one.joined_ns) <= kSecond,
               "a handshake ends in time", [&] { return one.text(); });
  journal_.law(!isAdmitted || one.reads_bytesPerMs == kReadsNothing || one.open <= one.mayLack ||
                   since(one.asked_ns) <= kAnswered_ns,
               "each request is answered in its time",
               [&] { return fmt::format("{}: {} open", one.text(), one.open); });
  if (isAdmitted && one.wantsFields && one.reads_bytesPerMs == kAtOnce) checkFlow(one);
}

/// Laws: an admitted subscriber receives the fields, and the description.
void RemotePeers::checkFlow(const One& one) const {
  constexpr std::int64_t kField_ns = 400 * kMs, kRenewed_ns = 1800 * kMs, kDescribed_ns = 700 * kMs;
  if (!instrument_.isThere()) return;
  const std::int64_t begun_ns = std::max({one.joined_ns, instrument_.changed_ns(), listens_ns_});
  const bool isForgotten = one.way == Way::kLatest && since(instrument_.forgot_ns()) <= kRenewed_ns;
  const std::int64_t expected_ns = std::max(begun_ns, one.came_ns[0]);
  journal_.law(isForgotten || since(expected_ns) <= kField_ns, "fields flow",
               [&] { return fmt::format("{}: none for {} ms", one.text(), since(one.came_ns[0]) / kMs); });
  journal_.law(one.way != Way::kStream || one.numbers[static_cast<std::size_t>(Published::kDescription)] > 0 ||
                   since(begun_ns) <= kDescribed_ns,
               "a new subscriber receives the description",
               [&] { return fmt::format("{} came {} ms ago", one.text(), since(one.joined_ns) / kMs); });
}

bool RemotePeers::wantsPreviews() const {
  return std::ranges::any_of(all_, [this](const auto& one) { return one->wantsPreviews && bus_.isAdmitted(one->fd); });
}

void RemotePeers::check() {
  constexpr std::int64_t kHeard_ns = 800 * kMs;
  constexpr std::size_t kMost_bytes = std::size_t{24} << 20;
  for (const auto& one : all_) checkOne(*one);
  const std::int64_t settled_ns =
      std::max({previewsChanged_ns_, instrument_.changed_ns(), listens_ns_, keys_.changed_ns(1), keys_.changed_ns(2)});
  journal_.law(!listens_ || !instrument_.isThere() || since(settled_ns) <= kHeard_ns ||
                   instrument_.wantsPreviews() == wantsPreviews(),
               "previews are requested while a client subscribes to them", "");
  journal_.law(Content::held_bytes() <= kMost_bytes, "memory stays bounded",
               [&] { return fmt::format("{} bytes wait", Content::held_bytes()); });
}

}  // namespace tractiond::simulation
