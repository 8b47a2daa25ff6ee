// Work that nobody waits for to the end.
#pragma once

#include <functional>
#include <future>

namespace tractiond {

/// Does the work on a thread of its own, which outlives the caller if need be; in the simulated world
/// (tests/simulation) at once. The future becomes ready when it is done.
std::future<void> aside(std::function<void()> work);

}  // namespace tractiond
