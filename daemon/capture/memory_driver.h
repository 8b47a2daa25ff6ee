// Pictures in memory as a camera: for benchmarks, replay and tests.
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
  std::vector<std::vector<std::uint8_t>> data;  ///< each without padding
};

void sleepUntilMonotonic(std::int64_t until_ns);

struct MemoryOptions {
  std::uint64_t loops = 1;     ///< 0: for ever
  std::int64_t period_ns = 0;  ///< 0: as fast as they are asked for; it then never times out
  std::function<std::int64_t()> now = monotonicNow;
  std::function<void(std::int64_t until_ns)> sleepUntil = sleepUntilMonotonic;
};

/// Hands out the pictures themselves, so any number may be out. They must outlive the driver. Each is a new one by its
/// id and by its time, that of the host.
OpenDriver fromMemory(const Pictures& pictures, const MemoryOptions& options = {});

}  // namespace tractiond::capture
