#include "tests/simulation/clients.h"

#include "tests/simulation/subscribers.h"
#include "traction/v1/control.pb.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace tractiond::simulation {
namespace {

namespace pb = traction::v1;

constexpr std::int64_t kSoon_ns = kSecond;       // what needs no camera and no disk
constexpr std::int64_t kLooks_ns = 2 * kSecond;  // a client stays after its answer, as a second one would come then

template <typename Choose>
std::string requestOf(Choose choose) {
  pb::Request request;
  request.set_version(1);
  choose(request);
  return request.SerializeAsString();
}

}  // namespace

struct Clients::One : Peer {
  One(Journal& account, Kind what)
      : journal(&account)
      , kind(what) {}

  void heed(std::span<const std::string_view> parts, std::uint64_t /*number*/) override {
    pb::Reply reply;
    const bool isRead = parts.size() == (beyond.empty() ? 2U : 3U) && parts[0] == beyond &&
                        parts[parts.size() - 2].empty() &&
                        reply.ParseFromArray(parts.back().data(), static_cast<int>(parts.back().size()));
    journal->law(isRead, "clients understand the answers", [&] { return fmt::format("{} parts", parts.size()); });
    journal->law(open > 0, "each request gets exactly one answer", "one more came");
    journal->law(fits(reply), "an answer is what was asked for", reply.ShortDebugString().substr(0, 80));
    --open;
    ++journal->result.answers;
    answered_ns = now();
  }

  bool fits(const pb::Reply& reply) const {
    if (!reply.error().empty()) return kind != Kind::kStatus && kind != Kind::kDescription;
    switch (kind) {
    case Kind::kStatus:
      return reply.has_status();
    case Kind::kDescription:
      return reply.has_description();
    case Kind::kZero:
      return reply.has_zero();
    case Kind::kStep:
      return reply.has_calibrate();
    case Kind::kFeature:
      return reply.has_camera();
    case Kind::kSnapshot:
      return reply.has_snapshot();
    case Kind::kError:
      return false;
    }
    return false;
  }

  Journal* journal;
  Kind kind;
  int fd = -1;
  std::string beyond;  ///< who asks through it
  int open = 0;        ///< requests without an answer
  std::int64_t sent_ns = now(), within_ns = kNever, answered_ns = now(), until_ns = kNever;
  bool isHostile = false;  ///< its connection may be ended
};

Clients::Clients(Bus& bus, const Starvation& starvation, Journal& journal)
    : bus_(bus)
    , starvation_(starvation)
    , journal_(journal) {}

Clients::~Clients() = default;

/// Returns the time that the control server needs for so many requests beside those that wait.
std::int64_t Clients::turnsFor_ns(std::size_t requests) const {
  constexpr std::size_t kPerTurn = 64;
  constexpr std::int64_t kTurn_ns = 110 * kMs;
  return static_cast<std::int64_t>((bus_.waitingRequests() + requests) / kPerTurn + 1) * kTurn_ns;
}

Clients::One* Clients::connect(Kind kind, std::int64_t within_ns, std::int64_t reads_bytesPerMs) {
  auto one = std::make_unique<One>(journal_, kind);
  const bool isLocal = reads_bytesPerMs == kAtOnce;
  one->fd = bus_.connect(kControlPort, *one, isLocal ? "localhost:1000:1000:4711" : "192.0.2.66", reads_bytesPerMs);
  if (one->fd < 0) return nullptr;
  one->within_ns = within_ns == kNever ? kNever : within_ns + turnsFor_ns(1);
  all_.push_back(std::move(one));
  return all_.back().get();
}

void Clients::ask(Kind kind, const std::string& request, std::int64_t within_ns) {
  One* const one = connect(kind, within_ns, kAtOnce);
  if (one == nullptr) return;
  one->open = 1;
  bus_.send(one->fd, std::array{std::string(), request});
}

void Clients::askZero(bool undo, bool anyway, std::int64_t within_ns) {
  ask(Kind::kZero, requestOf([&](pb::Request& request) {
        request.mutable_zero()->set_undo(undo);
        request.mutable_zero()->set_anyway(anyway);
      }),
      within_ns);
}

void Clients::askNoise(double seconds, std::int64_t within_ns) {
  ask(Kind::kStep,
      requestOf([&](pb::Request& request) { request.mutable_calibrate()->mutable_noise()->set_duration_s(seconds); }),
      within_ns);
}

void Clients::askFinish(std::int64_t within_ns) {
  ask(Kind::kStep, requestOf([](pb::Request& request) { request.mutable_calibrate()->mutable_finish(); }), within_ns);
}

/// Requests for the camera are passed on one after another.
void Clients::askCamera() {
  constexpr std::int64_t kEach_ns = 7500 * kMs;
  const auto before =
      std::ranges::count_if(all_, [](const auto& one) { return one->kind == Kind::kFeature && one->open > 0; });
  ask(Kind::kFeature,
      requestOf([](pb::Request& request) { request.mutable_camera()->mutable_read()->set_name("Gain"); }),
      (before + 1) * kEach_ns);
}

void Clients::askSnapshot() {
  constexpr std::int64_t kWithin_ns = 3500 * kMs;
  ask(Kind::kSnapshot, requestOf([](pb::Request& request) { request.mutable_snapshot(); }), kWithin_ns);
}

void Clients::heed(const Happening& one) {
  if (one.event == Event::kSnapshot) askSnapshot();
  if (one.event == Event::kRequests) askMany(one.amount, kAtOnce, 0);
  if (one.event == Event::kUnreadRequests) askMany(one.amount, kReadsNothing, one.for_ms * kMs);
  if (one.event == Event::kOddRequest) askOddly(one.amount);
}

void Clients::askMany(std::int64_t number, std::int64_t reads_bytesPerMs, std::int64_t stays_ns) {
  const bool isStatus = number % 2 == 0;
  const bool reads = reads_bytesPerMs == kAtOnce;
  for (const auto& other : all_) {
    if (other->within_ns != kNever) other->within_ns += turnsFor_ns(static_cast<std::size_t>(number));
  }
  const std::int64_t within_ns = kSoon_ns + turnsFor_ns(static_cast<std::size_t>(number));
  One* const one = connect(isStatus ? Kind::kStatus : Kind::kDescription, reads ? within_ns : kNever, reads_bytesPerMs);
  if (one == nullptr) return;
  one->until_ns = reads ? kNever : now() + stays_ns;
  const std::string request = requestOf([&](pb::Request& asked) {
    if (isStatus)
      asked.mutable_status();
    else
      asked.mutable_description();
  });
  const std::array parts{std::string(), request};
  for (std::int64_t i = 0; i < number && !bus_.hasEnded(one->fd); ++i) {
    ++one->open;
    bus_.send(one->fd, parts);
  }
}

/// Sends what is no request, or none of the usual form.
void Clients::askOddly(std::int64_t how) {
  const std::string status = requestOf([](pb::Request& request) { request.mutable_status(); });
  if (how == 0) return ask(Kind::kError, "no request", kSoon_ns);
  if (how == 1) return ask(Kind::kError, std::string("\x08\x63\x12\x00", 4), kSoon_ns);  // of version 99
  One* const one = connect(Kind::kStatus, kSoon_ns, kAtOnce);
  if (one == nullptr) return;
  if (how == 2) {  // through a gateway
    one->open = 1;
    one->beyond = "its client";
    return bus_.send(one->fd, std::array{one->beyond, std::string(), status});
  }
  one->isHostile = true;
  one->within_ns = kNever;
  one->until_ns = now() + kLooks_ns;
  if (how == 3) return bus_.send(one->fd, std::array{status});              // without an envelope
  bus_.send(one->fd, std::array{std::string(), std::string(70'000, 'x')});  // too large
}

void Clients::turn() {
  std::erase_if(all_, [this](const auto& one) {
    const bool isDone = one->open == 0 && now() - one->answered_ns > kLooks_ns && one->until_ns == kNever;
    if (!isDone && one->until_ns > now() && !(one->isHostile && bus_.hasEnded(one->fd))) return false;
    bus_.disconnect(one->fd);
    return true;
  });
}

void Clients::check() {
  for (const auto& one : all_) {
    journal_.law(one->isHostile || !bus_.hasEnded(one->fd), "who reads is not cut off", "a client with a request");
    const std::int64_t waited_ns = now() - one->sent_ns - starvation_.since(one->sent_ns);
    journal_.law(one->open == 0 || one->within_ns == kNever || waited_ns <= one->within_ns || bus_.hasEnded(one->fd),
                 "each request is answered in its time",
                 [&] { return fmt::format("{} ms, {} open", waited_ns / kMs, one->open); });
  }
}

void Clients::die() {
  for (const auto& one : all_) bus_.disconnect(one->fd);
  all_.clear();
}

}  // namespace tractiond::simulation
