// The time of day of a program, which a test may set: linked into it, or loaded before everything else (LD_PRELOAD).
#pragma once

#include <atomic>
#include <cstdint>

namespace tractiond::test {

/// Beside the true one [s]. Where $TRACTION_WALL_CLOCK names a file of eight bytes, that is it, and another program may
/// write there.
std::atomic<std::int64_t>& wallClockAhead_s();

}  // namespace tractiond::test
