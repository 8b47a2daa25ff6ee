#include "tests/simulation/supervisor.h"

#include "base/service/systemd.h"
#include "tests/simulation/disk.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace tractiond {
namespace {

constexpr std::chrono::milliseconds kPatience{800};  // WatchdogSec= of the unit

simulation::Supervisor*& listener() {
  static simulation::Supervisor* one = nullptr;
  return one;
}

}  // namespace

namespace systemd {

void notify(const std::string& text) {
  if (listener() != nullptr) listener()->hear(text);
}

std::chrono::microseconds watchdog() {
  return kPatience;
}

}  // namespace systemd

namespace simulation {
namespace {

constexpr std::int64_t kSoon_ns = 500 * kMs;  // some looks of the loop

std::int64_t nanoseconds(std::chrono::nanoseconds time) {
  return time.count();
}

}  // namespace

Supervisor::Supervisor(const ServiceHooks& hooks, const CaptureSide& camera, const Operator& person, Journal& journal,
                       const Starvation& starvation)
    : camera_(camera)
    , person_(person)
    , journal_(journal)
    , starvation_(starvation)
    , next_ns_(now())
    , fed_ns_(now())
    , loop_(attend(hooks)) {}

const ServiceHooks& Supervisor::attend(const ServiceHooks& hooks) {
  listener() = this;
  serviceRequests().stop.clear();  // of an earlier process
  serviceRequests().reload.clear();
  return hooks;
}

Supervisor::~Supervisor() {
  listener() = nullptr;
}

void Supervisor::askReload() {
  serviceRequests().reload.signal();
  if (!askedReload_ns_) askedReload_ns_ = now();
  if (!loop_.isReloading()) next_ns_ = now();
}

void Supervisor::askStop() {
  serviceRequests().stop.signal();
  askedStop_ns_ = next_ns_ = now();
}

void Supervisor::hear(const std::string& text) {
  const auto is = [&text](const char* begin) { return text.starts_with(begin); };
  if (is("WATCHDOG=1")) isFed_ = true;
  if (is("RELOADING=1")) askedReload_ns_.reset();
  const Notified before = notified_;
  if (is("READY=1")) notified_ = Notified::kReady;
  if (is("RELOADING=1")) notified_ = Notified::kReloading;
  if (is("STOPPING=1")) notified_ = Notified::kStopping;
  const bool isRight = before == Notified::kStopping       ? false
                       : is("READY=1")                     ? before != Notified::kReady
                       : is("RELOADING=1") || is("STATUS") ? before != Notified::kNothing
                                                           : true;
  journal_.law(isRight, "systemd is notified of start, reload and stop in their order", text);
}

bool Supervisor::turn() {
  if (hasEnded_ || next_ns_ > now()) return false;
  isFed_ = false;
  spent_ns() = 0;
  const std::int64_t waited_ns = disk()->waitedFor();
  hasEnded_ = !loop_.turn();
  next_ns_ = now() + nanoseconds(loop_.patience());
  journal_.law(spent_ns() == 0 && disk()->waitedFor() == waited_ns, "who feeds the watchdog waits for nothing",
               [&] { return fmt::format("{} ms", (spent_ns() + disk()->waitedFor() - waited_ns) / kMs); });
  if (hasEnded_) return true;
  journal_.law(!askedStop_ns_, "a stop ends it at once", "it goes on");
  checkFeeding();
  checkReload();
  return true;
}

void Supervisor::checkFeeding() {
  const auto still = std::ranges::find(hasTurned_, false) - hasTurned_.begin();
  const bool advances = still == kStages && !camera_.isHanging();
  journal_.law(isFed_ == advances, "the watchdog is fed if and only if every stage advances", [&] {
    return fmt::format("fed {}, stage {} stands still, the keeper hangs: {}; last fed {} ms ago", isFed_, still,
                       camera_.isHanging(), (now() - fed_ns_) / kMs);
  });
  if (isFed_) fed_ns_ = now();
  if (still == kStages) hasTurned_.fill(false);
}

void Supervisor::checkReload() const {
  journal_.law(loop_.isReloading() || notified_ == Notified::kReady, "systemd knows that the service is ready",
               [&] { return fmt::format("notified {}", static_cast<int>(notified_)); });
  if (loop_.isReloading()) {
    const std::int64_t over_ns = now() - person_.readUntil_ns();
    journal_.law(over_ns <= kSoon_ns, "a reload ends in time",
                 [&] { return fmt::format("{} ms after it was read", over_ns / kMs); });
  } else if (askedReload_ns_) {
    journal_.law(now() - *askedReload_ns_ <= kSoon_ns, "a reload begins in time",
                 [&] { return fmt::format("asked {} ms ago", (now() - *askedReload_ns_) / kMs); });
  }
}

/// Returns when the watchdog ends a daemon that does not feed it until then.
std::int64_t Supervisor::bites_ns() const {
  return fed_ns_ + nanoseconds(kPatience) + 1;
}

bool Supervisor::bites() const {
  if (now() < bites_ns()) return false;
  journal_.law(starvation_.since(fed_ns_) > 0 || camera_.isHanging(), "the watchdog ends only what stands still", "");
  return true;
}

}  // namespace simulation
}  // namespace tractiond
