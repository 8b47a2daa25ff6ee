#include "tests/simulation/gateway/run.h"

#include "tests/simulation/follow.h"

#include <fmt/format.h>

#include <algorithm>

namespace tractiond::simulation {
namespace {

constexpr std::int64_t kIdleTurn_ns = 100 * kMs;  // the relay sleeps no longer

std::string endpoint(std::size_t way) {
  return fmt::format("tcp://127.0.0.1:{}", kRemotePorts.at(way));
}

gateway::Config configured() {
  gateway::Config config;
  config.stream = {endpoint(0)};
  config.latest = {endpoint(1)};
  config.control = {endpoint(2)};
  config.preview = {endpoint(3)};
  config.keys = Keys::kDirectory;
  return config;
}

}  // namespace

GatewayRun::GatewayRun(const Story& story)
    : story_(story)
    , config_(configured())
    , chance_(story.seed)
    , keys_(disk_, journal_)
    , instrument_(bus_, ongoing_, config_.limits, journal_)
    , peers_(bus_, keys_, instrument_, starvation_, journal_) {
  disk() = &disk_;
  bus() = &bus_;
}

GatewayRun::~GatewayRun() {
  relay_.reset();
  disk() = nullptr;
  bus() = nullptr;
}

void GatewayRun::start() {
  if (startAt_ns_ > now()) return;
  auto opened = gateway::Relay::open(config_, kRuntime);
  journal_.law(opened.has_value(), "the gateway starts", [&] { return opened.error().message(); });
  relay_ = *std::move(opened);
  busyUntil_ns_ = turned_ns_ = now();
  journal_.say("the gateway runs");
  peers_.begin();
}

void GatewayRun::happen(const Happening& one) {
  ongoing_.begin(one);
  keys_.heed(one);
  if (one.event == Event::kInstrumentGone) peers_.loseRequests();
  instrument_.heed(one);
  peers_.heed(one);
  if (one.event == Event::kRelayStarved) {
    busyUntil_ns_ = std::max(busyUntil_ns_, ongoing_.until_ns(one.event));
    starvation_.add(busyUntil_ns_, one.for_ms * kMs);
  }
  if (one.event != Event::kRelayKilled || !relay_) return;
  constexpr std::int64_t kPause_ns = 500 * kMs;  // RestartSec= of the unit
  journal_.say("the gateway is killed");
  ++journal_.result.restarts;
  peers_.die();
  relay_.reset();
  startAt_ns_ = now() + kPause_ns;
}

/// Lets the relay take its turns until nothing waits.
void GatewayRun::work() {
  constexpr std::int64_t kCheck_ns = 20 * kMs;
  if (relay_ && busyUntil_ns_ <= now() && (bus_.isReadable() || turned_ns_ + kIdleTurn_ns <= now())) {
    turned_ns_ = now();
    const auto turned = relay_->turn(std::chrono::milliseconds(0));
    journal_.law(turned.has_value(), "the gateway keeps running", [&] { return turned.error().message(); });
    bus_.turn();
    busyUntil_ns_ = now() + 1000 * chance_.between(50, 400);
  }
  if (checkAt_ns_ > now()) return;
  checkAt_ns_ = now() + kCheck_ns;
  peers_.check();
}

std::int64_t GatewayRun::nextMoment() const {
  const std::int64_t next = std::min({instrument_.next_ns(), keys_.next_ns(), peers_.next_ns(), checkAt_ns_});
  if (!relay_) return std::min(next, startAt_ns_);
  return std::min(next, std::max(busyUntil_ns_, bus_.isReadable() ? now() : turned_ns_ + kIdleTurn_ns));
}

void GatewayRun::turn() {
  keys_.turn();
  instrument_.turn();
  bus_.turn();
  peers_.turn();
  if (!relay_) start();
  work();
}

void GatewayRun::go(const std::function<bool()>& goesOn) {
  start();
  const bool isOver = follow(
      story_, goesOn, [this] { return nextMoment(); }, [this](const Happening& one) { happen(one); },
      [this] { turn(); });
  if (!isOver) return;
  journal_.say(fmt::format("{} fields, {} requests forwarded, {} messages received, {} answers",
                           instrument_.published(Published::kField), instrument_.requests(), journal_.result.delivered,
                           journal_.result.answers));
}

}  // namespace tractiond::simulation
