// Something a thread can sleep on, also together with sockets.
#pragma once

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdint>
#include <system_error>

namespace tractiond {

/// An eventfd. Any thread, also a signal handler, signals; what is signalled before wait() is not lost. Thread-safe.
class Event {
 public:
  /// Throws std::system_error when the process has no file descriptor left.
  Event()
      : fd_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
    if (fd_ < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
  }
  ~Event() { close(fd_); }
  Event(const Event&) = delete;
  Event& operator=(const Event&) = delete;

  void signal() noexcept {
    const std::uint64_t one = 1;
    [[maybe_unused]] const auto written = ::write(fd_, &one, sizeof one);
  }

  /// Returns when signalled (true), after `timeout`, or earlier for no reason (a signal handler ran).
  bool wait(std::chrono::milliseconds timeout) noexcept {
    pollfd item{fd_, POLLIN, 0};
    const bool signalled = poll(&item, 1, static_cast<int>(timeout.count())) > 0;
    if (signalled) clear();
    return signalled;
  }

  /// Forgets the signals given so far: for those who poll fd() themselves.
  void clear() noexcept {
    std::uint64_t signals = 0;
    [[maybe_unused]] const auto got = ::read(fd_, &signals, sizeof signals);
  }

  /// Readable while signalled.
  int fd() const { return fd_; }

 private:
  int fd_;
};

}  // namespace tractiond
