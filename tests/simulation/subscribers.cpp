#include "tests/simulation/subscribers.h"

#include "proto/traction/v1/endpoints.h"
#include "traction/v1/header.pb.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace tractiond::simulation {
namespace {

constexpr std::array<const char*, 4> kKinds = {"field", "markers", "description", "status"};
enum Kind : std::size_t { kField, kMarkers, kDescription, kStatus };

/// Reads the header of a published message, which is its second field, behind the time stamp.
bool readHeader(std::string_view bytes, traction::v1::Header& header) {
  constexpr char kTimeStamp = 9, kHeader = 18;
  if (bytes.starts_with(kTimeStamp)) bytes.remove_prefix(std::min<std::size_t>(9, bytes.size()));
  if (!bytes.starts_with(kHeader)) return false;
  bytes.remove_prefix(1);
  std::size_t size = 0;
  for (int shift = 0; !bytes.empty(); shift += 7) {
    const auto byte = static_cast<unsigned char>(bytes.front());
    bytes.remove_prefix(1);
    size |= static_cast<std::size_t>(byte & 127) << shift;
    if (byte < 128) break;
  }
  return size <= bytes.size() && header.ParseFromArray(bytes.data(), static_cast<int>(size));
}

/// What a message says that many subscribers read: it is parsed once.
struct Read {
  std::uint64_t number = 0, sequence = 0, frame = 0;
  std::size_t kind = 0;
  bool isAfterGap = false;  ///< FLAG_DISCONTINUITY
  std::string boot;
};

const Read& readOnce(std::span<const std::string_view> parts, std::uint64_t number, const Journal& journal) {
  static Read last;
  static traction::v1::Header header;
  if (last.number == number) return last;
  static const std::array<std::string, kKinds.size()> topics = [] {
    std::array<std::string, kKinds.size()> all;
    std::ranges::transform(kKinds, all.begin(), [](const char* kind) { return traction::topicOf(kSensor, kind); });
    return all;
  }();
  const bool isWhole = parts.size() == 1 || parts.size() == 3;
  const auto topic = parts.size() == 1 ? topics.begin() : std::ranges::find(topics, parts[0]);
  const bool isRead = isWhole && topic != topics.end() && readHeader(parts[parts.size() == 1 ? 0 : 1], header);
  journal.law(isRead, "subscribers understand what is sent", [number] { return fmt::format("message {}", number); });
  last = {number,
          header.sequence(),
          header.frame_number(),
          static_cast<std::size_t>(topic - topics.begin()),
          (header.flags() & traction::v1::FLAG_DISCONTINUITY) != 0,
          header.boot()};
  return last;
}

}  // namespace

struct Subscribers::One : Peer {
  One(Journal& account, int toPort, std::vector<std::string> wanted, std::int64_t reads, std::int64_t until)
      : journal(&account)
      , port(toPort)
      , topics(std::move(wanted))
      , reads_bytesPerMs(reads)
      , until_ns(until) {}

  void heed(std::span<const std::string_view> parts, std::uint64_t number) override {
    const Read& is = readOnce(parts, number, *journal);
    std::uint64_t& before = sequences[is.kind];
    const bool isFirst = before == 0;
    const auto what = [&] {
      return fmt::format("{} {} of frame {} after {} of frame {}", kKinds[is.kind], is.sequence, is.frame, before,
                         frames[is.kind]);
    };
    const bool rises = isFirst || (is.sequence > before && is.boot == boot);
    const bool isNewer = isFirst || is.kind == kDescription || is.kind == kStatus || is.frame > frames[is.kind];
    journal->law(rises && isNewer, "nothing is sent twice or out of order", what);
    journal->law(isFirst || reads_bytesPerMs != kAtOnce || is.sequence == before + 1, "who reads at once loses nothing",
                 what);
    const bool isNext = isFirst || is.sequence > before + 1 || is.frame == frames[is.kind] + 1;
    journal->law(is.kind == kDescription || is.kind == kStatus || isNext || is.isAfterGap,
                 "a field that does not follow the one before has its flag", what);
    journal->law(is.kind != kMarkers || reads_bytesPerMs != kAtOnce || is.frame == frames[kField],
                 "the markers of a field follow it", what);
    ++journal->result.delivered;
    before = is.sequence;
    frames[is.kind] = is.frame;
    came_ns[is.kind] = now();
    boot = is.boot;
  }

  Journal* journal;
  int port;
  std::vector<std::string> topics;
  std::int64_t reads_bytesPerMs, until_ns;
  std::int64_t toggles_ns = 0, togglesNext_ns = kNever;  ///< how often it takes its mind of previews, 0: never
  bool wantsPreviews = false;
  int toggled = 0;  ///< since it has connected
  int left = 0;     ///< how often it has connected again by its own wish
  int fd = -1;
  std::int64_t joins_ns = 0, joined_ns = 0;
  std::array<std::uint64_t, kKinds.size()> sequences{}, frames{};  ///< of the last message; 0: none yet
  std::array<std::int64_t, kKinds.size()> came_ns{};
  std::string boot;
};

Subscribers::Subscribers(Bus& bus, const Starvation& starvation, Journal& journal)
    : bus_(bus)
    , starvation_(starvation)
    , journal_(journal) {
  add({journal_, kStreamPort, {std::string(traction::kTopicRoot) + kSensor + "/"}, kAtOnce, kNever});
  add({journal_, kLatestPort, {""}, kAtOnce, kNever});
}

Subscribers::~Subscribers() = default;

void Subscribers::add(One one) {
  all_.push_back(std::make_unique<One>(std::move(one)));
}

/// libzmq accepts some 5,000 connections a second.
void Subscribers::connectAll() {
  constexpr std::int64_t kEach_ns = 10 * kMs;
  constexpr int kAtATime = 50;
  int number = 0;
  for (const auto& one : all_) {
    if (one->fd < 0) one->joins_ns = now() + number++ / kAtATime * kEach_ns;
  }
  findNext();
  turn();
}

void Subscribers::connect(One& one) {
  one.sequences = one.frames = {};
  one.joined_ns = now();
  one.came_ns.fill(now());
  one.fd = bus_.connect(one.port, one, "192.0.2.20", one.reads_bytesPerMs);
  for (const std::string& topic : one.topics) bus_.send(one.fd, std::array{'\1' + topic});
  one.toggled = 0;
  if (one.toggles_ns > 0) toggle(one);
}

void Subscribers::begin() {
  listens_ = true;
  connectAll();
}

void Subscribers::die() {
  listens_ = false;
  for (const auto& one : all_) {
    bus_.disconnect(std::exchange(one->fd, -1));
    one->wantsPreviews = false;
    one->togglesNext_ns = kNever;
  }
  findNext();
}

void Subscribers::heed(const Happening& one) {
  const std::int64_t until_ns = now() + one.for_ms * kMs;
  const std::string field = traction::topicOf(kSensor, kKinds[kField]);
  const std::string description = traction::topicOf(kSensor, kKinds[kDescription]);
  switch (one.event) {
  case Event::kSubscribers:
  case Event::kDeadSubscribers:
    for (std::int64_t i = 0; i < one.amount; ++i)
      add({journal_,
           kStreamPort,
           {field, description},
           one.event == Event::kSubscribers ? kAtOnce : kReadsNothing,
           until_ns});
    break;
  case Event::kSlowSubscriber:
    add({journal_, kStreamPort, {std::string(traction::kTopicRoot)}, one.amount, until_ns});
    break;
  case Event::kPreviews: {
    One undecided(journal_, kStreamPort, {description}, kAtOnce, until_ns);
    undecided.toggles_ns = one.amount * kMs;
    add(std::move(undecided));
    break;
  }
  default:
    return;
  }
  connectAll();
}

void Subscribers::turn() {
  if (next_ns_ > now()) return;
  std::erase_if(all_, [this](const auto& one) {
    if (one->until_ns > now()) return false;
    bus_.disconnect(one->fd);
    if (one->wantsPreviews) previewsChanged_ns_ = now();
    return true;
  });
  for (const auto& one : all_) {
    if (listens_ && one->fd < 0 && one->joins_ns <= now()) connect(*one);
    if (one->togglesNext_ns <= now()) toggle(*one);
  }
  findNext();
}

void Subscribers::findNext() {
  next_ns_ = kNever;
  for (const auto& one : all_)
    next_ns_ =
        std::min({next_ns_, one->until_ns, one->togglesNext_ns, listens_ && one->fd < 0 ? one->joins_ns : kNever});
}

/// Call by call: subscribes to previews, and cancels that. One that does so each even number of milliseconds subscribes
/// once more, and soon connects again, every second time after a second.
void Subscribers::toggle(One& one) {
  constexpr int kLast = 2;
  constexpr std::int64_t kSoon_ns = 20 * kMs;
  const int call = one.toggled++;
  const bool leaves = one.toggles_ns / kMs % 2 == 0;
  if (leaves && call > kLast) {
    leave(one);
    if (++one.left % 2 == 0) one.joins_ns += kSecond;
    return;
  }
  const bool isLast = leaves && call == kLast, wants = call % 2 == 0;
  one.togglesNext_ns = now() + (isLast ? kSoon_ns : one.toggles_ns);
  one.wantsPreviews = wants;
  previewsChanged_ns_ = now();
  bus_.send(one.fd, std::array{(wants ? '\1' : '\0') + traction::topicOf(kSensor, "preview")});
}

/// Ends its connection, and connects again as ZeroMQ does.
void Subscribers::leave(One& one) {
  constexpr std::int64_t kAgain_ns = 100 * kMs;
  bus_.disconnect(std::exchange(one.fd, -1));
  one.wantsPreviews = false;
  one.togglesNext_ns = kNever;
  previewsChanged_ns_ = now();
  one.joins_ns = now() + kAgain_ns;
}

bool Subscribers::wantsPreviews() const {
  return std::ranges::any_of(all_, [](const auto& one) { return one->wantsPreviews; });
}

std::uint64_t Subscribers::statuses() const {
  return all_.front()->sequences[kStatus];
}

void Subscribers::heedPublished(const FrameInfo& info) const {
  for (const auto& one : {all_.begin(), std::next(all_.begin())}) {
    const std::uint64_t frame = (*one)->frames[kField];
    journal_.law(frame == info.frameNumber, "each published field reaches who reads at once",
                 [&] { return fmt::format("frame {}, not {}, at port {}", frame, info.frameNumber, (*one)->port); });
  }
}

void Subscribers::checkOne(One& one) {
  constexpr std::int64_t kStatus_ns = 1300 * kMs, kDescribed_ns = 500 * kMs;
  const auto since = [this](std::int64_t at_ns) { return now() - at_ns - starvation_.since(at_ns); };
  journal_.law(!bus_.hasEnded(one.fd), "a subscriber stays connected",
               [&] { return fmt::format("one of port {}", one.port); });
  if (one.reads_bytesPerMs != kAtOnce || one.port != kStreamPort) return;
  journal_.law(one.sequences[kDescription] > 0 || since(one.joined_ns) <= kDescribed_ns,
               "a subscriber is told the description",
               [&] { return fmt::format("{} ms ago it came", since(one.joined_ns) / kMs); });
  const bool wantsStatus = &one == all_.front().get();
  journal_.law(!wantsStatus || since(one.came_ns[kStatus]) <= kStatus_ns, "a status comes each second",
               [&] { return fmt::format("the last came {} ms ago", since(one.came_ns[kStatus]) / kMs); });
}

void Subscribers::check() {
  constexpr std::size_t kEach_bytes = 3'000'000, kRequests_bytes = std::size_t{24} << 20;
  std::size_t slow = 0;
  for (const auto& one : all_) {
    if (one->fd < 0) continue;
    checkOne(*one);
    slow += one->reads_bytesPerMs == kAtOnce ? 0 : 1;
  }
  journal_.law(Content::held_bytes() <= kRequests_bytes + slow * kEach_bytes, "memory stays bounded", [&] {
    return fmt::format("{} bytes wait, {} subscribers do not read at once", Content::held_bytes(), slow);
  });
}

}  // namespace tractiond::simulation
