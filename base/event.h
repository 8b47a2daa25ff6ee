// An event that a thread can wait for, also together with sockets.
#pragma once

#include <chrono>

namespace tractiond {

/// An eventfd of the operating system; in the simulated world (tests/simulation) a flag, for which no thread sleeps.
/// May be signalled in a signal handler. A signal before wait() is not lost. Thread-safe.
class Event {
 public:
  /// \throws std::system_error if the process has no file descriptor left
  Event();
  ~Event();
  Event(const Event&) = delete;
  Event& operator=(const Event&) = delete;

  void signal() noexcept;

  /// Waits at most `timeout` for a signal. Returns whether there was one; may return false early.
  bool wait(std::chrono::milliseconds timeout) noexcept;

  /// Forgets the signals given so far. For callers that poll fd() themselves.
  void clear() noexcept;

  /// Returns a descriptor that is readable while the event is signalled.
  int fd() const { return fd_; }

 private:
  int fd_;
};

}  // namespace tractiond
