// An event that a thread can wait for, also together with sockets.
#pragma once

#include <chrono>

namespace tractiond {

/// An eventfd of the operating system; in the simulated world (tests/simulation) a flag: wait() lets simulated time
/// pass on a thread that may stop in the middle of a turn, and does not wait on others, and fd() is no descriptor.
/// signal() may be called by any thread and by a signal handler; a signal given before wait() is not lost. Thread-safe.
class Event {
 public:
  /// Makes an event that is not signalled.
  /// \throws std::system_error if the process has no file descriptor left
  Event();
  ~Event();
  Event(const Event&) = delete;
  Event& operator=(const Event&) = delete;

  /// Signals the event and wakes a thread in wait(). May change errno.
  void signal() noexcept;

  /// Waits for a signal and clears it: several signals count as one. Returns true if there was one, false after
  /// `timeout` or when a signal handler of the process has interrupted the wait. If several threads wait, one signal
  /// may wake more than one of them.
  /// \param timeout 0: does not wait; negative: no limit
  bool wait(std::chrono::milliseconds timeout) noexcept;

  /// Clears the event, for callers that poll fd() themselves. Does not wait, and has no effect if nothing was
  /// signalled.
  void clear() noexcept;

  /// Returns a descriptor that is readable while the event is signalled. The event owns it: it must not be closed.
  int fd() const { return fd_; }

 private:
  int fd_;
};

}  // namespace tractiond
