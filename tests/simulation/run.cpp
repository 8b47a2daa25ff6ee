#include "tests/simulation/run.h"

#include <fmt/format.h>

#include <algorithm>

namespace tractiond::simulation {
namespace {

constexpr std::uint64_t kMostInFlight = 18;       // the links' slots, and one with each stage
constexpr std::int64_t kIdleTurn_ns = 100 * kMs;  // a stage sleeps no longer

}  // namespace

Run::Run(const Gel& gel, const Story& story)
    : gel_(gel)
    , story_(story)
    , chance_(story.seed)
    , modelling_{Chance(story.seed ^ 0x30de1), {}}
    , camera_(gel, ongoing_, chance_)
    , zeros_(gel, disk_, journal_)
    , askers_(zeros_, starvation_, journal_)
    , person_(disk_, journal_)
    , stepWork_(disk_)
    , fields_(zeros_, starvation_, journal_) {
  disk_.condition = [this](std::int64_t at_ns) { return diskAt(at_ns); };
  disk() = &disk_;
}

Run::~Run() {
  life_.reset();
  disk() = nullptr;
}

Disk::Condition Run::diskAt(std::int64_t at) const {
  Disk::Condition is;
  for (const Happening& one : story_.happenings) {
    if (at_ns(one) > at) break;
    if (at_ns(one) + one.for_ms * kMs <= at) continue;
    if (one.event == Event::kSlowDisk) is.sync_ns = is.open_ns = one.amount * kMs;
    is.isFull = is.isFull || one.event == Event::kFullDisk;
    is.failsToSync = is.failsToSync || one.event == Event::kFailingDisk;
  }
  return is;
}

void Run::happen(const Happening& one) {
  ongoing_.begin(one);
  camera_.apply(one);
  disturb(one);
  switch (one.event) {
  case Event::kTimeSet:
    clocks().realAhead_ns += one.amount * kSecond;
    break;
  case Event::kStarved:
    starve(one);
    break;
  case Event::kKill:
  case Event::kPowerCut:
    one.event == Event::kKill ? die("the daemon is killed") : die("the power is lost", true);
    break;
  case Event::kZero:
  case Event::kZeroAnyway:
  case Event::kUndo:
  case Event::kQuestion:
  case Event::kNoise:
  case Event::kFinish:
    if (!life_) break;
    life_->ask(one);
    controlAt_ns_ = std::max(now(), busyUntil_ns_[kControl]);  // it is woken
    break;
  case Event::kReopen:
    person_.edit(static_cast<Edit>(one.amount));
    if (!life_) break;
    journal_.say("asked: a reload");
    life_->supervisor().askReload();
    break;
  case Event::kRestart:
    if (life_) life_->supervisor().askStop();
    break;
  default:
    break;
  }
}

/// Fields need not flow while the camera's pictures do not, or have just changed their order.
void Run::disturb(const Happening& one) {
  switch (one.event) {
  case Event::kLoss:
  case Event::kBroken:
  case Event::kSilence:
  case Event::kAgain:
  case Event::kLate:
  case Event::kFewMarkers:
  case Event::kGone:
  case Event::kSlowAnswers:
  case Event::kHeld:
  case Event::kHangs:
    return fields_.disturb(ongoing_.until_ns(one.event));
  case Event::kIdsRestart:
  case Event::kIdsJump:
  case Event::kClockStep:
  case Event::kOtherPictures:
  case Event::kReopen:
    return fields_.disturb(now());
  default:
    return;
  }
}

void Run::starve(const Happening& one) {
  const auto stage = static_cast<std::size_t>(one.amount);
  std::int64_t& busy_ns = busyUntil_ns_[stage];
  busy_ns = std::max(busy_ns, ongoing_.until_ns(one.event));
  if (stage == kModelling) return modelling_.starvation.add(busy_ns, one.for_ms * kMs);  // fields flow all the same
  if (stage == kControl) controlAt_ns_ = std::max(controlAt_ns_, busy_ns);
  starvation_.add(busy_ns, one.for_ms * kMs);
  fields_.disturb(busy_ns);
}

void Run::start() {
  if (startAt_ns_ > now()) return;
  startAt_ns_ = kNever;
  if (!zeros_.isIdle() || !stepWork_.isIdle()) {
    journal_.say("systemd kills the daemon, which has not stopped");
    stepWork_.die();
    disk_.kill(now());
  }
  zeros_.die();
  // The search for contacts takes most of the time: every eighth story has it.
  life_ = std::make_unique<Life>(Around{.gel = gel_,
                                        .camera = camera_,
                                        .zeros = zeros_,
                                        .askers = askers_,
                                        .person = person_,
                                        .fields = fields_,
                                        .journal = journal_,
                                        .chance = chance_,
                                        .starvation = starvation_,
                                        .modelling = modelling_,
                                        .ongoing = ongoing_,
                                        .stepWork = stepWork_});
  waited_ns_ = disk_.waitedFor();
  busyUntil_ns_.fill(now());
  turned_ns_.fill(now());
  ready_.fill(false);
  controlAt_ns_ = keeperAt_ns_ = now();
  journal_.say("the daemon runs");
}

void Run::die(const char* why, bool powerIsCut) {
  if (!life_) return;
  journal_.say(why);
  ++journal_.result.restarts;
  journal_.result.account.add(life_->ledger());
  life_->checkBalance(kMostInFlight);
  life_.reset();
  zeros_.die();
  askers_.die();
  stepWork_.die();
  if (powerIsCut) {
    disk_.losePower(now(), chance_);
  } else {
    disk_.kill(now());
  }
  startAt_ns_ = now() + 2 * kSecond;
  fields_.disturb(startAt_ns_);
}

void Run::keep() {
  constexpr std::int64_t kUsual_ns = 1 * kSecond;
  do keeperAt_ns_ = life_->camera().keeperTurn();
  while (keeperAt_ns_ <= now());
  // A call that has begun takes its time, also when the fault has ended.
  const std::int64_t busyUntil_ns = life_->camera().keeperIsBusyUntil_ns();
  if (busyUntil_ns > now() + kUsual_ns) fields_.disturb(busyUntil_ns);
}

/// The stages that are ready take turns until none is. Law: that ends.
void Run::work() {
  constexpr int kMostTurns = 100'000;
  if (keeperAt_ns_ <= now()) keep();
  for (int turns = 0;; ++turns) {
    journal_.law(turns < kMostTurns, "time goes on", [] { return "stages take turns without end"; });
    std::array<std::size_t, kStages.size()> able{};
    std::size_t count = 0;
    ready_[0] = life_->wakes_ns() <= now();
    for (std::size_t i = 0; i < kStages.size(); ++i) {
      ready_[i] = ready_[i] || turned_ns_[i] + kIdleTurn_ns <= now();
      const std::int64_t until_ns = std::max(busyUntil_ns_[i], life_->waitsUntil_ns(kStages[i]));
      if (ready_[i] && until_ns <= now()) able[count++] = i;
    }
    const bool canModel = std::max(busyUntil_ns_[kModelling], life_->solving().modelWakes_ns()) <= now();
    if (canModel && (count == 0 || modelling_.chance.oneIn(2))) {
      life_->solving().modelTurn();
      continue;
    }
    if (count == 0) break;
    const std::size_t i = able[count == 1 ? 0 : chance_.below(count)];
    turned_ns_[i] = now();
    if (!life_->turn(kStages[i])) {
      ready_[i] = life_->waitsUntil_ns(kStages[i]) != 0;
      if (i == 0) keep();  // it may have been given something
      continue;
    }
    constexpr std::array<std::int64_t, kStages.size()> kLongest_us = {100, 6000, 4000, 300};
    busyUntil_ns_[i] = now() + 1000 * chance_.between(kLongest_us[i] / 4, kLongest_us[i]);
    if (i + 1 < kStages.size()) ready_[i + 1] = true;
  }
  if (controlAt_ns_ <= now()) control();
  Supervisor& supervisor = life_->supervisor();
  if (supervisor.turn()) keep();  // it may have been given something
  if (supervisor.hasEnded()) return leave();
  if (supervisor.bites()) return die("the watchdog ends the daemon");
}

/// The service's loop has ended: the daemon works off what is in flight, and waits for the work of its threads. Law:
/// for nothing else. systemd ends it after a while, and it is started again.
void Run::leave() {
  constexpr std::int64_t kPause_ns = 500 * kMs;  // RestartSec= of the unit
  // It cannot use its first camera.
  if (life_->hasEnded()) return die("the daemon ends with an error");
  journal_.say("the daemon stops");
  ++journal_.result.restarts;
  stop();
  spent_ns() = 0;
  life_.reset();
  journal_.law(spent_ns() < kSecond, "a stop waits for no reload",
               [&] { return fmt::format("{} ms", spent_ns() / kMs); });
  askers_.die();
  const std::int64_t idle_ns = std::max(zeros_.idle_ns(), stepWork_.idle_ns());
  startAt_ns_ = std::min(idle_ns, now() + Supervisor::kStopsWithin_ns) + kPause_ns;
  fields_.disturb(startAt_ns_);
}

void Run::control() {
  const bool wasAsked = life_->camera().isAsked();
  life_->turn(Stage::kControl);
  if (!wasAsked && life_->camera().isAsked()) keep();  // the keeper is woken
  journal_.law(disk_.waitedFor() == waited_ns_, "the control thread waits for no disk",
               [&] { return fmt::format("{} ms", (disk_.waitedFor() - waited_ns_) / kMs); });
  zeros_.noteTurn();
  controlAt_ns_ = now() + (life_->procedures().hurried() ? 3 : chance_.between(20, 100)) * kMs;
  askers_.check();
  fields_.checkFlow();
  life_->checkConfiguration();
  life_->camera().check();
  life_->checkBalance(kMostInFlight);
  const auto cameAtOnce = [this](std::int64_t within_ns) {
    const std::int64_t since = now() - within_ns;
    return ongoing_.until_ns(Event::kLate) > since || life_->camera().opened_ns() > since;  // pictures that waited
  };
  constexpr std::int64_t kUnderWay_ns = 200 * kMs, kSolved_ns = 300 * kMs;  // since the last look, and what was then
  life_->checkEvictions(cameAtOnce(kUnderWay_ns), cameAtOnce(kSolved_ns));
}

std::int64_t Run::nextMoment() const {
  std::int64_t next = std::min({camera_.next_ns(), zeros_.next_ns(), stepWork_.next_ns()});
  if (!life_) return std::min(next, startAt_ns_);
  next = std::min({next, controlAt_ns_, keeperAt_ns_, life_->supervisor().next_ns(),
                   std::max(life_->wakes_ns(), busyUntil_ns_[0])});
  for (std::size_t i = 1; i < kStages.size(); ++i) {
    const std::int64_t ready_ns = ready_[i] ? life_->waitsUntil_ns(kStages[i]) : turned_ns_[i] + kIdleTurn_ns;
    next = std::min(next, std::max(busyUntil_ns_[i], ready_ns));
  }
  next = std::min(next, std::max(busyUntil_ns_[kModelling], life_->solving().modelWakes_ns()));
  return next;
}

void Run::stop() {
  if (!life_) return;
  life_->stop();
  journal_.result.account.add(life_->ledger());
}

void Run::turn() {
  camera_.turn();
  zeros_.turn();
  stepWork_.turn();
  if (!life_) start();
  if (life_) work();
}

void Run::go() {
  start();
  const std::int64_t end_ns = now() + story_.lasts_ms * kMs;
  for (auto next = story_.happenings.begin(); now() < end_ns;) {
    const auto next_ns = [&] { return next == story_.happenings.end() ? kNever : at_ns(*next); };
    clocks().monotonic_ns = std::max(now(), std::min({nextMoment(), next_ns(), end_ns}));
    while (next_ns() <= now()) happen(*next++);
    turn();
  }
  stop();
  const Account& account = journal_.result.account;
  journal_.say(fmt::format("{} fields, {} of them valid", account.fields(), account.valid()));
}

}  // namespace tractiond::simulation
