#include "tests/simulation/world.h"

#include "daemon/base/clock.h"

namespace tractiond {

std::int64_t clockNow(clockid_t clock) {
  const simulation::Clocks& now = simulation::clocks();
  return now.monotonic_ns + (clock == CLOCK_REALTIME ? now.realAhead_ns : 0);
}

namespace simulation {

Clocks& clocks() {
  static Clocks now;
  return now;
}

}  // namespace simulation
}  // namespace tractiond
