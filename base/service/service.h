// A program as a service: signals, limits, and systemd's notifications and watchdog.
#pragma once

#include "base/background_thread.h"
#include "base/clock.h"
#include "base/counter.h"
#include "base/error.h"
#include "base/event.h"

#include <tl/expected.hpp>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <functional>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <vector>

namespace tractiond {

/// Makes SIGTERM and SIGINT end run(), and SIGHUP reload, or also end run() if standard error is a terminal: the
/// terminal has hung up. Must be called by the thread that calls run(), before this program starts its first thread:
/// threads inherit the blocked signals. (OpenBLAS's threads, which start before main(), may receive them all the same.)
void catchSignals();

/// Lets those signals reach the calling thread, whose waits they interrupt. run() does so; a program with a loop of its
/// own (ServiceLoop) calls it once its threads are started.
void admitSignals();

/// What signals ask of the service.
struct ServiceRequests {
  Event stop, reload;
};
/// Returns those of this process, which live until it ends. Thread-safe. A signal handler may call it once
/// catchSignals() has been called.
ServiceRequests& serviceRequests();

/// Lets a stop signal end the process during the start, as long as the object exists: computing factors takes
/// seconds, a camera that another program holds ten. Feeds the watchdog meanwhile, which already runs where a service
/// starts again (ServiceHooks::startsAgain). Requires catchSignals().
class StopWhileStarting {
 public:
  /// \param leave ends the process; called on a thread of its own after the signal. The destructor waits for that
  /// thread, some 50 ms at most.
  explicit StopWhileStarting(std::function<void()> leave);

 private:
  std::jthread thread_;
};

/// Raises the limit of file descriptors to the hard limit: each connection takes one, and ZeroMQ and GLib end the
/// process if none is left. Fails with EX_OSERR if that is less than 256.
tl::expected<void, Error> raiseDescriptorLimit();

/// Returns whether standard error is systemd's journal. The journal reads a line's priority from its start
/// (sd-daemon(3)), and adds time and program by itself.
bool logsToJournal();

/// What run() needs of a program. run() calls the functions on its own thread, except `reload`; `ended` and
/// `statusLine` must be set.
struct ServiceHooks {
  std::vector<const Counter*> loops;        ///< turns of each of the program's loops
  std::function<bool()> ended;              ///< returns whether the program has ended by itself
  std::function<std::string()> statusLine;  ///< returns the line for `systemctl status`
  /// Reads the configuration again, on a thread of its own, as a disk may take seconds. Returns what applies it, which
  /// is called by run() itself; may be empty. A stop does not wait for the reading: it must own what it uses.
  std::function<std::function<void()>()> reload = {};
  std::function<bool()> others = {};                ///< liveness check of library threads; must not wait; none: alive
  std::int64_t (*monotonicClock)() = monotonicNow;  ///< times the updates of the status line [ns]
  /// Returns whether run() is to return because the program starts again, as the same process; may be empty.
  std::function<bool()> startsAgain = {};
};

/// Returns the time between two looks whether the watchdog is to be fed: a quarter of its time, as a stage may take
/// half of that for one turn, and at most 1 s.
std::chrono::milliseconds feedingPeriod();

/// What run() does between two waits. Thread-bound.
class ServiceLoop {
 public:
  /// Tells systemd that the service is ready. The hooks must outlive this.
  explicit ServiceLoop(const ServiceHooks& hooks);

  /// Handles the serviceRequests(): begins a reload, and applies what one has read. Tells systemd the status once a
  /// second. Feeds the watchdog if the library threads are alive, and every loop has made a turn since the last call in
  /// which all had; at first since the construction if each had made one by then, else since its start. Does not wait.
  /// Returns false, and tells systemd, if the service is to stop, has ended by itself, or starts again.
  bool turn();
  /// Returns after how long turn() is to be called again: at most 1 s, and 20 ms during a reload. If there is a
  /// request, the caller should call turn() at once, except for a reload during another one.
  std::chrono::milliseconds patience() const;
  /// Returns whether a reload is under way.
  bool isReloading() const { return reader_ != nullptr; }

 private:
  void beginReload();
  void endReload();
  bool haveAllAdvanced();

  const ServiceHooks& hooks_;
  const std::chrono::milliseconds patience_;
  std::vector<std::uint64_t> seen_;           ///< turns of the loops when all had advanced last
  std::unique_ptr<BackgroundThread> reader_;  ///< while a reload is read
  std::future<std::function<void()>> apply_;  ///< what it has read
  std::int64_t reported_ns_;                  ///< when the status was reported last
};

/// Notifies systemd that the service is ready, feeds the watchdog while all of it advances, and reloads on SIGHUP.
/// Returns on SIGTERM or SIGINT, or when the program has ended by itself, which it notices within a second. Without
/// systemd it does the same, without notifications. Requires catchSignals(), whose signals it unblocks for the calling
/// thread.
/// \param hooks must outlive the call
void run(const ServiceHooks& hooks);

}  // namespace tractiond
