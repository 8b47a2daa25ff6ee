// Replaces the time of day of a program, so that a test can set it; linked into the program or loaded by LD_PRELOAD.
#pragma once

#include <atomic>
#include <cstdint>

namespace tractiond::test {

/// Returns the difference of the program's time of day to the true one [s], which may be changed. If the environment
/// variable TRACTION_WALL_CLOCK names a file of eight bytes, they are the difference, and another program may write
/// them.
std::atomic<std::int64_t>& wallClockAhead_s();

}  // namespace tractiond::test
