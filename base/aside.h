// Background work that may outlive its caller.
#pragma once

#include <functional>
#include <future>

namespace tractiond {

/// Does the work on a detached thread; in the simulated world (tests/simulation) before it returns. The future becomes
/// ready when the work is done; its destructor does not wait.
std::future<void> aside(std::function<void()> work);

}  // namespace tractiond
