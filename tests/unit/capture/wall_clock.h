// The time of day of this program, which a test may set.
#pragma once

#include <atomic>
#include <cstdint>

namespace tractiond::test {

/// Beside the true one.
extern std::atomic<std::int64_t> wallClockAhead_s;

}  // namespace tractiond::test
