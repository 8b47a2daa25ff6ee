// Counts what the test program allocates.
#pragma once

#include <cstdint>

namespace tractiond::support {

/// Returns the number of calls of operator new since the program started, by all threads. A program that calls it must
/// link traction_test_allocations, which replaces operator new. Thread-safe.
std::uint64_t allocations();

}  // namespace tractiond::support
