// Counts what the test program allocates.
#pragma once

#include <cstdint>

namespace tractiond::support {

/// Calls of operator new so far, by all threads. Link traction_test_allocations.
std::uint64_t allocations();

}  // namespace tractiond::support
