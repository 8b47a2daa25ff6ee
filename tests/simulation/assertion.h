// Ends what fails an assertion, without the program. assertion.cpp defines what a failed assert() calls.
#pragma once

#include <functional>
#include <optional>
#include <string>

namespace tractiond::simulation {

/// Calls `work` on a thread of its own. Returns the assertion that failed in it, with its place; nothing if it
/// returned. After a failure the thread stays where it is for ever: what `work` refers to must outlive the program, and
/// may be in any state.
std::optional<std::string> failedAssertionOf(const std::function<void()>& work);

}  // namespace tractiond::simulation
