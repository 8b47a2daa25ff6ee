#include "daemon/capture/memory_source.h"

#include <cassert>
#include <cerrno>
#include <ctime>

namespace tractiond::capture {

void sleepUntilMonotonic(std::int64_t until_ns) {
  const timespec until{until_ns / 1'000'000'000, until_ns % 1'000'000'000};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
  }
}

MemorySource::MemorySource(const Pictures& pictures, const Options& options)
    : pictures_(pictures)
    , options_(options) {
  assert(!pictures.data.empty() && pictures.height > 0);
}

Next MemorySource::next(Frame& frame, std::chrono::milliseconds timeout) {
  if (options_.loops > 0 && count_ == options_.loops * pictures_.data.size()) return Next::kEnd;
  const std::int64_t asked_ns = options_.now();
  if (count_ == 0) start_ns_ = asked_ns;
  const std::int64_t due_ns = start_ns_ + static_cast<std::int64_t>(count_) * options_.period_ns;
  if (due_ns > asked_ns) {
    const std::int64_t until_ns = asked_ns + std::chrono::nanoseconds(timeout).count();
    if (until_ns < due_ns) {
      options_.sleepUntil(until_ns);
      return Next::kTimeout;
    }
    options_.sleepUntil(due_ns);
  }
  const std::vector<std::uint8_t>& picture = pictures_.data[count_ % pictures_.data.size()];
  ++count_;
  if (options_.ledger) options_.ledger->received.add();
  frame = Frame{};
  frame.info.cameraFrameId = count_;
  frame.info.frameNumber = count_;
  frame.info.times.received_ns = options_.now();
  frame.info.times.receivedReal_ns = realNow();
  frame.info.times.captured_ns = frame.info.times.received_ns;
  frame.info.times.device_ns = frame.info.times.received_ns;
  frame.data = picture.data();
  frame.size = picture.size();
  frame.width = pictures_.width;
  frame.height = pictures_.height;
  frame.stride = traitsOf(pictures_.format).stride(pictures_.width);
  frame.format = pictures_.format;
  return Next::kFrame;
}

void MemorySource::recycle(Frame& frame) {
  frame.data = nullptr;
}

}  // namespace tractiond::capture
