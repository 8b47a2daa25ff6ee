// Defines time and chance of the simulation. world.cpp defines the daemon's clocks by it.
#pragma once

#include <cstdint>
#include <limits>

namespace tractiond::simulation {

/// SplitMix64 (Steele, Lea and Flood 2014): the same numbers on every machine.
class Chance {
 public:
  explicit Chance(std::uint64_t seed)
      : state_(seed) {}

  std::uint64_t next() {
    std::uint64_t z = state_ += 0x9e3779b97f4a7c15U;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9U;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebU;
    return z ^ (z >> 31);
  }
  /// Returns a number from 0 to n - 1; n must not be 0.
  std::uint64_t below(std::uint64_t n) { return next() % n; }
  /// Returns a number from `low` to `high`, both included.
  std::int64_t between(std::int64_t low, std::int64_t high) {
    return low + static_cast<std::int64_t>(below(static_cast<std::uint64_t>(high - low) + 1));
  }
  bool oneIn(std::uint64_t n) { return below(n) == 0; }

 private:
  std::uint64_t state_;
};

/// What the host's clocks show while a simulation runs.
struct Clocks {
  std::int64_t monotonic_ns = 0;
  std::int64_t realAhead_ns = 0;  ///< of CLOCK_REALTIME to CLOCK_MONOTONIC
  std::int64_t hurried_ns = 0;    ///< to be added to both: a turn that is ended waits no longer (fiber.h)
};
Clocks& clocks();
inline std::int64_t now() {
  return clocks().monotonic_ns;
}

/// Returns the time [ns] that the calls take that were made since it was set to 0. They take effect at once; the caller
/// is busy for that time.
std::int64_t& spent_ns();
/// Returns when a background thread becomes idle next; kNever if all are.
std::int64_t nextIdle_ns();
/// Forgets the background threads of an earlier run.
void forgetBackground();

inline constexpr std::int64_t kMs = 1'000'000, kSecond = 1'000'000'000;
inline constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();

}  // namespace tractiond::simulation
