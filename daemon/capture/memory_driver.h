// A driver of pictures in memory, for benchmarks and tests.
#pragma once

#include "base/clock.h"
#include "daemon/capture/driver.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace tractiond::capture {

struct Pictures {
  int width = 0, height = 0;  ///< px
  PixelFormat format = PixelFormat::kRgb8;
  std::vector<std::vector<std::uint8_t>> data;  ///< one element per picture, without padding
};

void sleepUntilMonotonic(std::int64_t until_ns);

struct MemoryOptions {
  std::uint64_t loops = 1;     ///< number of times that the pictures are delivered; 0: without end
  std::int64_t period_ns = 0;  ///< time between pictures; 0: as fast as they are popped, without timeouts
  std::function<std::int64_t()> now = monotonicNow;
  std::function<void(std::int64_t until_ns)> sleepUntil = sleepUntilMonotonic;
};

/// Returns a driver that lends the pictures themselves, any number at a time. They must outlive the driver. Each has a
/// new id, and the host's time.
OpenDriver fromMemory(const Pictures& pictures, const MemoryOptions& options = {});

}  // namespace tractiond::capture
