// Delivers pictures in memory as a camera does.
#pragma once

#include "base/clock.h"
#include "daemon/capture/driver.h"

#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

namespace tractiond::test {

struct Pictures {
  int width = 0, height = 0;  ///< px
  PixelFormat format = PixelFormat::kRgb8;
  std::vector<std::vector<std::uint8_t>> data;  ///< one element per picture, all of one size, without padding
};

class MemoryDriver : public capture::Driver {
 public:
  MemoryDriver(const Pictures& pictures, std::uint64_t loops)
      : pictures_(pictures)
      , loops_(loops) {
    info_.name.id = info_.name.model = "memory";
    info_.shape = {pictures.width, pictures.height, pictures.data.at(0).size(), 0};
    info_.format = pictures.format;
  }

  const capture::CameraInfo& info() const override { return info_; }
  capture::Popped pop(capture::Buffer& buffer, std::chrono::milliseconds /*timeout*/) override {
    if (loops_ > 0 && count_ == loops_ * pictures_.data.size()) return capture::Popped::kEnd;
    const std::vector<std::uint8_t>& picture = pictures_.data[count_ % pictures_.data.size()];
    buffer.arrival.complete = true;
    buffer.arrival.shape = info_.shape;
    buffer.arrival.id = ++count_;
    buffer.arrival.host_ns = monotonicNow();
    buffer.arrival.device_ns = last_ns_ = std::max(buffer.arrival.host_ns, last_ns_ + 1);
    buffer.data = picture.data();
    buffer.stride = static_cast<int>(picture.size()) / pictures_.height;
    buffer.awaited = true;
    buffer.handle = this;
    return capture::Popped::kBuffer;
  }
  void giveBack(void* /*handle*/) override {}
  Discard discard() const override {
    return [](void*) {};
  }

 private:
  const Pictures& pictures_;
  std::uint64_t loops_;
  capture::CameraInfo info_;
  std::uint64_t count_ = 0;
  std::int64_t last_ns_ = 0;
};

/// Returns a function that opens a driver for the pictures, which must outlive it. Ids count from 1; time stamps are
/// the host's, but always increase.
/// \param loops how often the pictures are delivered; 0: without end
inline capture::OpenDriver fromMemory(const Pictures& pictures, std::uint64_t loops) {
  return [&pictures, loops](const capture::Opening&) -> tl::expected<std::unique_ptr<capture::Driver>, Error> {
    return std::make_unique<MemoryDriver>(pictures, loops);
  };
}

}  // namespace tractiond::test
