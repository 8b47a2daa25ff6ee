// The host's clocks in nanoseconds.
#pragma once

#include <cstdint>
#include <ctime>

namespace tractiond {

inline std::int64_t clockNow(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

inline std::int64_t monotonicNow() {
  return clockNow(CLOCK_MONOTONIC);
}
inline std::int64_t realNow() {
  return clockNow(CLOCK_REALTIME);
}

}  // namespace tractiond
