#include "daemon/capture/memory_driver.h"

#include <cassert>
#include <cerrno>
#include <ctime>

namespace tractiond::capture {

void sleepUntilMonotonic(std::int64_t until_ns) {
  const timespec until{until_ns / 1'000'000'000, until_ns % 1'000'000'000};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
  }
}

namespace {

class MemoryDriver : public Driver {
 public:
  MemoryDriver(const Pictures& pictures, MemoryOptions options)
      : pictures_(pictures)
      , options_(std::move(options)) {
    assert(!pictures.data.empty() && pictures.height > 0);
    info_.name.id = info_.name.model = "memory";
    info_.shape = {pictures.width, pictures.height, pictures.data.front().size(), 0};
    info_.format = pictures.format;
  }

  const CameraInfo& info() const override { return info_; }
  Popped pop(Buffer& buffer, std::chrono::milliseconds timeout) override;
  void giveBack(void* /*handle*/) override {}
  Discard discard() const override {
    return [](void*) {};
  }

 private:
  const Pictures& pictures_;
  MemoryOptions options_;
  CameraInfo info_;
  std::uint64_t count_ = 0;  ///< handed out
  std::int64_t start_ns_ = 0, last_ns_ = 0;
};

Popped MemoryDriver::pop(Buffer& buffer, std::chrono::milliseconds timeout) {
  if (options_.loops > 0 && count_ == options_.loops * pictures_.data.size()) return Popped::kEnd;
  const std::int64_t asked_ns = options_.now();
  if (count_ == 0) start_ns_ = asked_ns;
  const std::int64_t due_ns = start_ns_ + static_cast<std::int64_t>(count_) * options_.period_ns;
  if (due_ns > asked_ns) {
    const std::int64_t until_ns = asked_ns + std::chrono::nanoseconds(timeout).count();
    if (until_ns < due_ns) {
      options_.sleepUntil(until_ns);
      return Popped::kNothing;
    }
    options_.sleepUntil(due_ns);
  }
  const std::vector<std::uint8_t>& picture = pictures_.data[count_ % pictures_.data.size()];
  buffer.arrival.complete = true;
  buffer.arrival.shape = info_.shape;
  buffer.arrival.shape.size = picture.size();
  buffer.arrival.id = ++count_;
  buffer.arrival.host_ns = options_.now();
  buffer.arrival.device_ns = last_ns_ = std::max(buffer.arrival.host_ns, last_ns_ + 1);
  buffer.data = picture.data();
  buffer.stride = static_cast<int>(picture.size()) / pictures_.height;
  buffer.awaited = true;
  buffer.handle = this;
  return Popped::kBuffer;
}

}  // namespace

OpenDriver fromMemory(const Pictures& pictures, const MemoryOptions& options) {
  return [&pictures, options](const Opening& /*opening*/) -> tl::expected<std::unique_ptr<Driver>, Error> {
    return std::make_unique<MemoryDriver>(pictures, options);
  };
}

}  // namespace tractiond::capture
