#include "base/event.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <system_error>

namespace tractiond {

Event::Event()
    : fd_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  if (fd_ < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
}

Event::~Event() {
  close(fd_);
}

void Event::signal() noexcept {
  const std::uint64_t one = 1;
  [[maybe_unused]] const auto written = ::write(fd_, &one, sizeof one);
}

bool Event::wait(std::chrono::milliseconds timeout) noexcept {
  pollfd item{fd_, POLLIN, 0};
  const bool signalled = poll(&item, 1, static_cast<int>(timeout.count())) > 0;
  if (signalled) clear();
  return signalled;
}

void Event::clear() noexcept {
  std::uint64_t signals = 0;
  [[maybe_unused]] const auto got = ::read(fd_, &signals, sizeof signals);
}

}  // namespace tractiond
