// Delivers pictures in memory as a camera does: for benchmarks, replay and tests.
#pragma once

#include "base/clock.h"
#include "daemon/capture/driver.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tractiond::capture {

struct Pictures {
  int width = 0, height = 0;  ///< px
  PixelFormat format = PixelFormat::kRgb8;
  std::vector<std::vector<std::uint8_t>> data;  ///< one element per picture, without padding
};

/// Sleeps until a time of CLOCK_MONOTONIC [ns]; not at all if that has passed.
void sleepUntilMonotonic(std::int64_t until_ns);

struct MemoryOptions {
  std::uint64_t loops = 1;               ///< how often the pictures are delivered; 0: without end
  std::int64_t period_ns = 0;            ///< time between two pictures; 0: none, pop() then never times out
  std::int64_t (*now)() = monotonicNow;  ///< [ns]
  void (*sleepUntil)(std::int64_t until_ns) = sleepUntilMonotonic;  ///< sleeps until a time of `now`
};

/// Returns a function that opens a driver for the pictures, and does not fail. Its buffers point to the pictures
/// themselves, so any number of them may be out; the pictures must outlive the function and the driver. There must be
/// at least one (asserted), all of one size. Rows have no padding. Ids count from 1; time stamps are those of `now`,
/// but always increase. After the last loop pop() returns kEnd, with EX_OK.
OpenDriver fromMemory(const Pictures& pictures, const MemoryOptions& options = {});

}  // namespace tractiond::capture
