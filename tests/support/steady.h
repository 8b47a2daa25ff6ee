// Repeats tests of the timing of several threads if the machine itself stood still while they ran.
#pragma once

#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

namespace tractiond::test {

/// Measures how long the processors stand still: while it lives, one thread on each processor that the process may use
/// sleeps for a millisecond again and again. Thread-safe.
class Pauses {
 public:
  Pauses();
  ~Pauses();
  /// Returns the longest delay of such a sleep since the last call, because the machine stood still or other programs
  /// used its processors.
  std::chrono::milliseconds takeLongest();

 private:
  std::atomic<std::int64_t> longest_ns_{0};
  std::atomic<bool> ending_{false};
  std::vector<std::thread> threads_;
};

/// Longest pause of the machine in which a camera's packets wait in their buffers and none is lost.
inline constexpr std::chrono::milliseconds kSteady{20};

/// Runs all Google tests. If one fails and the machine stood still for longer than kSteady meanwhile, the failure
/// proves nothing: prints that, and executes the program again with the same arguments, up to five times in all.
/// Returns the exit code of the last run.
int runWhereTheMachineIsSteady(int argc, char** argv);

}  // namespace tractiond::test
