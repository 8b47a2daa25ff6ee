// The host's clocks in nanoseconds.
#pragma once

#include <cstdint>
#include <ctime>

namespace tractiond {

/// Reads a clock of the operating system, or of the simulated world (tests/simulation), whichever is linked.
/// Thread-safe.
std::int64_t clockNow(clockid_t clock);

inline std::int64_t monotonicNow() {
  return clockNow(CLOCK_MONOTONIC);
}
inline std::int64_t rawNow() {
  return clockNow(CLOCK_MONOTONIC_RAW);
}
inline std::int64_t realNow() {
  return clockNow(CLOCK_REALTIME);
}

/// One moment on two clocks: CLOCK_MONOTONIC, which runs as fast as the time of day is corrected, and
/// CLOCK_MONOTONIC_RAW, which is never corrected.
struct HostMoment {
  std::int64_t monotonic_ns = 0, raw_ns = 0;
};
inline HostMoment hostNow() {
  constexpr std::int64_t kUndisturbed_ns = 1000;
  HostMoment moment;
  for (int attempt = 0; attempt < 4; ++attempt) {
    moment.monotonic_ns = monotonicNow();
    moment.raw_ns = rawNow();
    if (monotonicNow() - moment.monotonic_ns < kUndisturbed_ns) break;
  }
  return moment;
}

}  // namespace tractiond
