#include "tests/simulation/world.h"

#include "base/clock.h"
#include "base/event.h"

#include <utility>

namespace tractiond {

std::int64_t clockNow(clockid_t clock) {
  const simulation::Clocks& now = simulation::clocks();
  return now.monotonic_ns + (clock == CLOCK_REALTIME ? now.realAhead_ns : 0);
}

namespace {

constexpr int kCalm = -1, kSignalled = -2;  // in the place of the descriptor

}  // namespace

Event::Event()
    : fd_(kCalm) {}

Event::~Event() = default;

void Event::signal() noexcept {
  fd_ = kSignalled;
}

bool Event::wait(std::chrono::milliseconds /*timeout*/) noexcept {
  return std::exchange(fd_, kCalm) == kSignalled;
}

void Event::clear() noexcept {
  fd_ = kCalm;
}

namespace simulation {

Clocks& clocks() {
  static Clocks now;
  return now;
}

}  // namespace simulation
}  // namespace tractiond
