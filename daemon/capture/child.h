// Runs a program as a child process with limits, so that its crash or an endless loop does not harm the parent.
#pragma once

#include <chrono>
#include <stop_token>
#include <string>
#include <vector>

namespace tractiond::capture {

struct ChildOptions {
  std::string program = "/proc/self/exe";  ///< path; by default this program, even if its file was replaced
  std::chrono::milliseconds patience{10'000};
  std::size_t most_bytes = std::size_t{1} << 20;  ///< limit of its output, and of its errors
};

struct ChildEnd {
  enum class How { kExit, kSignal, kLate, kTooMuch, kStopped, kNotStarted };
  How how = How::kNotStarted;
  int code = 0;                ///< exit code, signal or errno
  std::string output, errors;  ///< read so far
};

/// Starts the program with these arguments and without standard input, reads its output, and kills it when the time is
/// over. Blocks until it has ended. Any thread.
ChildEnd runChild(const std::vector<std::string>& arguments, const ChildOptions& options,
                  const std::stop_token& stop = {});

/// Limits this process to what the evaluation of a description needs: 1 GiB more address space, 5 s of processor time,
/// no core dump, no writable files, death with the parent. Must be called first in the child.
void limitChild();

/// Returns why a child gave no answer, as the end of a sentence: "crashes (signal 11)"; empty: it ended by itself.
std::string misdeed(const ChildEnd& end);

}  // namespace tractiond::capture
