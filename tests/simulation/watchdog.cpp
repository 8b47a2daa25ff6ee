#include "tests/simulation/watchdog.h"

#include <fmt/format.h>

#include <algorithm>

namespace tractiond::simulation {
namespace {

constexpr std::chrono::milliseconds kPatience{800};  // WatchdogSec= of the unit

std::int64_t nanoseconds(std::chrono::nanoseconds time) {
  return time.count();
}

}  // namespace

Watchdog::Watchdog(const Turns& turns, const CaptureSide& camera, Journal& journal, const Starvation& starvation)
    : camera_(camera)
    , journal_(journal)
    , starvation_(starvation)
    , hooks_{.loops = loopsOf(turns),
             .ended = {},
             .statusLine = {},
             .others = [&camera] { return !camera.isForsaken(); }}
    , check_(hooks_)
    , next_ns_(now())
    , fed_ns_(now()) {}

void Watchdog::turn() {
  if (next_ns_ > now()) return;
  next_ns_ = now() + nanoseconds(LivenessCheck::period(kPatience));
  const bool isFed = check_.isAlive();
  const auto still = std::ranges::find(hasTurned_, false) - hasTurned_.begin();
  const bool advances = still == kStages && !camera_.isHanging();
  journal_.law(isFed == advances, "the watchdog is fed if and only if every stage advances",
               fmt::format("fed {}, stage {} stands still, the keeper hangs: {}; last fed {} ms ago", isFed, still,
                           camera_.isHanging(), (now() - fed_ns_) / kMs));
  if (isFed) fed_ns_ = now();
  if (still == kStages) hasTurned_.fill(false);
}

bool Watchdog::bites() const {
  if (now() - fed_ns_ <= nanoseconds(kPatience)) return false;
  journal_.law(starvation_.since(fed_ns_) > 0 || camera_.isHanging(), "the watchdog ends only what stands still", "");
  return true;
}

}  // namespace tractiond::simulation
