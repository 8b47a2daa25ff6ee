// Runs a program as a child process with limits, so that its crash or endless loop does not affect the parent.
#pragma once

#include <chrono>
#include <stop_token>
#include <string>
#include <vector>

namespace tractiond {

struct ChildOptions {
  std::string program = "/proc/self/exe";         ///< path, or a name to be found by PATH; default: this very program
  std::chrono::milliseconds patience{10'000};     ///< longest run
  std::size_t most_bytes = std::size_t{1} << 20;  ///< limit of its standard output, and of its standard error
};

struct ChildEnd {
  enum class How {
    kExit,
    kSignal,      ///< ended by a signal that this process did not send, not by one that asks both to end
    kLate,        ///< killed after `patience`
    kTooMuch,     ///< killed because it printed more than `most_bytes`
    kStopped,     ///< killed because a stop was requested
    kNotStarted,  ///< could not be started
  };
  How how = How::kNotStarted;
  int code = 0;                ///< exit code for kExit, signal for kSignal, errno for kNotStarted; else 0
  std::string output, errors;  ///< standard output and standard error, as far as they were read
};

/// Runs the program with an empty standard input, and reads its output. Kills it after `patience`, when it prints more
/// than `most_bytes`, or when a stop is requested. The child blocks the signals that a terminal or a service manager
/// sends to parent and child together (SIGINT, SIGTERM, SIGHUP, SIGQUIT). Blocks until it has ended. Reentrant.
/// \param arguments without the name of the program
ChildEnd runChild(const std::vector<std::string>& arguments, const ChildOptions& options,
                  const std::stop_token& stop = {});

}  // namespace tractiond
