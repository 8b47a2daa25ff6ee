// A program as a service: signals, and what systemd wants to know.
#pragma once

#include "base/clock.h"
#include "base/counter.h"
#include "base/error.h"

#include <tl/expected.hpp>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <thread>
#include <vector>

namespace tractiond {

/// SIGTERM and SIGINT from now on only let run() return, and SIGHUP lets it reload; on a terminal that hangs up, SIGHUP
/// ends it too. To be called by the thread that calls run(), before the first thread of ours starts: they inherit that
/// it does not disturb them. (OpenBLAS's threads, which are there before main(), may take the signal as well.)
void catchSignals();

/// While it lives, what is started may take its time, and a stop signal does not wait for it: an inverse takes seconds,
/// a camera that another program holds ten. After catchSignals().
class StopWhileStarting {
 public:
  /// \param leave ends the process, on a thread of its own, when it is still starting `patience` after the signal.
  /// Otherwise run() returns at once.
  explicit StopWhileStarting(std::function<void()> leave,
                             std::chrono::milliseconds patience = std::chrono::milliseconds(500));

 private:
  std::jthread thread_;
};

/// Every connection takes a descriptor, and ZeroMQ and GLib end the process where none is left: so it takes as many as
/// it may have. Fails with EX_OSERR where those are too few for anything.
tl::expected<void, Error> raiseDescriptorLimit();

/// Libraries hang or end the process where memory is refused, some already when it ends. Fails with EX_OSERR where the
/// address space is limited to less than an inverse, the threads' stacks and a camera's buffers take.
tl::expected<void, Error> checkAddressSpace();

/// Standard error goes to systemd's journal, which reads a line's priority from its start (sd-daemon(3)) and knows by
/// itself who writes.
bool logsToJournal();

/// Has every loop made a turn since it was asked last?
class StageWatch {
 public:
  explicit StageWatch(std::vector<const Counter*> loops);
  bool allAdvanced();

 private:
  std::vector<const Counter*> loops_;
  std::vector<std::uint64_t> seen_;
};

struct ServiceHooks {
  std::vector<const Counter*> loops;                ///< of the running program, each counting its turns
  std::function<bool()> ended;                      ///< it has come to its end by itself
  std::function<std::string()> statusLine;          ///< for `systemctl status`
  std::function<void()> reload = {};                ///< the configuration
  std::function<bool()> others = {};                ///< do the other threads work? Must not wait
  std::int64_t (*monotonicClock)() = monotonicNow;  ///< for when the status is told again [ns]
};

/// Decides whether the watchdog is fed. Thread-bound.
class LivenessCheck {
 public:
  /// The hooks outlive it.
  explicit LivenessCheck(const ServiceHooks& hooks)
      : hooks_(hooks)
      , watch_(hooks.loops) {}

  /// Returns whether every loop has advanced since this was true last, and the others work. Waits for nothing.
  bool isAlive() {
    const bool others = !hooks_.others || hooks_.others();
    return watch_.allAdvanced() && others;
  }

  /// Returns the time between two checks. Four fit into the watchdog's patience, as a stage may take half of it for one
  /// turn. 0: there is no watchdog.
  static std::chrono::milliseconds period(std::chrono::microseconds watchdog) {
    constexpr std::chrono::milliseconds kLongest{1000};
    const auto quarter = std::chrono::duration_cast<std::chrono::milliseconds>(watchdog / 4);
    return watchdog.count() == 0 ? kLongest : std::min(kLongest, quarter);
  }

 private:
  const ServiceHooks& hooks_;
  StageWatch watch_;
};

/// Tells systemd that the service is ready, feeds its watchdog while every loop advances and the others work, reloads
/// on SIGHUP, and returns on SIGTERM or SIGINT or when it has ended. Without systemd it only waits.
void run(const ServiceHooks& hooks);

}  // namespace tractiond
