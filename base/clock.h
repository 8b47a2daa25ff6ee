// Reads the host's clocks, in nanoseconds.
#pragma once

#include <cstdint>
#include <ctime>

namespace tractiond {

/// Returns the time of a clock [ns], of the operating system or of the simulated world (tests/simulation), whichever is
/// linked. The clock must exist: an error is not reported. Thread-safe.
std::int64_t clockNow(clockid_t clock);

/// Returns CLOCK_MONOTONIC [ns].
inline std::int64_t monotonicNow() {
  return clockNow(CLOCK_MONOTONIC);
}
/// Returns CLOCK_MONOTONIC_RAW, which is neither set nor slewed [ns].
inline std::int64_t rawNow() {
  return clockNow(CLOCK_MONOTONIC_RAW);
}
/// Returns CLOCK_REALTIME: the time of day [ns since 1970].
inline std::int64_t realNow() {
  return clockNow(CLOCK_REALTIME);
}

/// One moment on two clocks: CLOCK_MONOTONIC, whose rate follows the corrections of the time of day, and
/// CLOCK_MONOTONIC_RAW, which is not corrected.
struct HostMoment {
  std::int64_t monotonic_ns = 0, raw_ns = 0;
};
/// Reads both clocks within 1 us, or, after four interrupted attempts, less closely. Thread-safe.
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
