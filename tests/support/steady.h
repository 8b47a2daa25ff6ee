// Tests that a program of several threads keeps time, on a machine that may itself stand still.
#pragma once

#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

namespace tractiond::test {

/// While it lives, one thread on each processor asks for a moment every millisecond. Thread-safe.
class Pauses {
 public:
  Pauses();
  ~Pauses();
  /// The longest that one of them has waited for its moment since the last call: the machine's standing still, or
  /// others that take its processors.
  std::chrono::milliseconds takeLongest();

 private:
  std::atomic<std::int64_t> longest_ns_{0};
  std::atomic<bool> ending_{false};
  std::vector<std::thread> threads_;
};

/// The longest pause in which a camera's packets wait where they are, and nothing is lost.
inline constexpr std::chrono::milliseconds kSteady{20};

/// Runs the tests. If one fails while the machine stands still for longer than that, it says nothing of the program:
/// they run again, up to five times in all, and it is said. What the last run says, holds.
int runWhereTheMachineIsSteady(int argc, char** argv);

}  // namespace tractiond::test
