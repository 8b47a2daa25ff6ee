// Runs a program as a child process with limits, so that its crash or endless loop does not affect the parent.
#pragma once

#include <chrono>
#include <stop_token>
#include <string>
#include <vector>

namespace tractiond::capture {

struct ChildOptions {
  std::string program = "/proc/self/exe";  ///< path, not searched in PATH; the default is this very program
  std::chrono::milliseconds patience{10'000};
  std::size_t most_bytes = std::size_t{1} << 20;  ///< limit of its output, and of its errors
};

struct ChildEnd {
  enum class How { kExit, kSignal, kLate, kTooMuch, kStopped, kNotStarted };
  How how = How::kNotStarted;
  int code = 0;                ///< exit code, signal or errno
  std::string output, errors;  ///< read so far
};

/// Starts the program without standard input and reads its output. Kills it after `patience`, when it prints more than
/// `most_bytes`, or when a stop is requested. Blocks until it has ended. Any thread.
ChildEnd runChild(const std::vector<std::string>& arguments, const ChildOptions& options,
                  const std::stop_token& stop = {});

/// Limits this process; the child must call it first. Allows 1 GiB of address space beyond the present size, 5 s of
/// processor time, no core dump and no writing to files; the kernel ends the process with its parent.
void limitChild();

/// Describes why a child gave no answer, as the end of a sentence: "crashes (signal 11)". Empty if it ended by itself.
std::string misdeed(const ChildEnd& end);

}  // namespace tractiond::capture
