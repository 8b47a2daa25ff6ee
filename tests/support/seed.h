// The one source of chance in the tests. Twin: seed.py.
#pragma once

#include <charconv>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace tractiond::test {

/// Seed of every run in which TRACTION_SEED is not set, the gate's among them.
inline constexpr std::uint32_t kFixedSeed = 20050125;

/// Returns the seed of all random draws of this test program: the number in the environment variable TRACTION_SEED, or
/// kFixedSeed. Prints it once for each program. Ends the program with 64 (EX_USAGE) when TRACTION_SEED is no number
/// below 2^32. Thread-safe.
inline std::uint32_t seed() {
  static const std::uint32_t value = [] {
    std::uint32_t number = kFixedSeed;
    if (const char* const given = std::getenv("TRACTION_SEED")) {
      const char* const end = given + std::strlen(given);
      const auto [rest, error] = std::from_chars(given, end, number);
      if (error != std::errc() || rest != end) {
        std::fprintf(stderr, "TRACTION_SEED is '%s', must be a whole number below 2^32\n", given);
        std::exit(64);
      }
    }
    std::printf("seed %u: repeat with TRACTION_SEED=%u\n", number, number);
    std::fflush(stdout);
    return number;
  }();
  return value;
}

}  // namespace tractiond::test
