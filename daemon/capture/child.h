// A program as a child with limits: what ends it, or keeps it busy, costs the parent nothing.
#pragma once

#include <chrono>
#include <stop_token>
#include <string>
#include <vector>

namespace tractiond::capture {

struct ChildOptions {
  std::string program = "/proc/self/exe";  ///< path, not looked for in PATH; this one, also when its file was replaced
  std::chrono::milliseconds patience{10'000};
  std::size_t most_bytes = std::size_t{1} << 20;  ///< of its output, and of its errors
};

struct ChildEnd {
  enum class How { kExit, kSignal, kLate, kTooMuch, kStopped, kNotStarted };
  How how = How::kNotStarted;
  int code = 0;                ///< of the exit; or the signal; or errno
  std::string output, errors;  ///< as far as they were read
};

/// Starts it with these arguments and without standard input, reads what it prints, and kills it after its time. Blocks
/// until it has ended. Any thread.
ChildEnd runChild(const std::vector<std::string>& arguments, const ChildOptions& options,
                  const std::stop_token& stop = {});

/// In the child, first of all: takes from the process what no description needs. 1 GiB of address space beyond what it
/// has, 5 s of processor time, no core dump, no file to write to; it dies with its parent.
void limitChild();

/// Why a child gave no answer, as the end of a sentence: "crashes (signal 11)"; empty: it ended by itself.
std::string misdeed(const ChildEnd& end);

}  // namespace tractiond::capture
