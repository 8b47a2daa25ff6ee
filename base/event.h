// Something a thread can sleep on, also together with sockets.
#pragma once

#include <chrono>

namespace tractiond {

/// An eventfd of the operating system; in the simulated world (tests/simulation) a flag, and nobody sleeps. Any thread,
/// also a signal handler, signals; what is signalled before wait() is not lost. Thread-safe.
class Event {
 public:
  /// Throws std::system_error when the process has no file descriptor left.
  Event();
  ~Event();
  Event(const Event&) = delete;
  Event& operator=(const Event&) = delete;

  void signal() noexcept;

  /// Returns when signalled (true), after `timeout`, or earlier for no reason (a signal handler ran).
  bool wait(std::chrono::milliseconds timeout) noexcept;

  /// Forgets the signals given so far: for those who poll fd() themselves.
  void clear() noexcept;

  /// Readable while signalled.
  int fd() const { return fd_; }

 private:
  int fd_;
};

}  // namespace tractiond
