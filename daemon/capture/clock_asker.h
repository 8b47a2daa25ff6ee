// Reads a camera's clock and fits the readings.
#pragma once

#include "daemon/capture/clock_fit.h"

#include <array>
#include <cstdint>
#include <memory>
#include <utility>

namespace tractiond::capture {

/// A camera's counter that can be latched: it stores its value at that moment, which is read afterwards.
class LatchedCounter {
 public:
  virtual ~LatchedCounter() = default;
  // Make the counter store its value, and read the stored value, 64 bits. Return false if the camera refuses, or does
  // not answer in time.
  virtual bool latch() = 0;
  virtual bool read(std::array<std::uint8_t, 8>& bytes) = 0;
  virtual std::int64_t rawNow() = 0;  ///< Returns CLOCK_MONOTONIC_RAW of the host [ns].

  std::uint64_t perSecond = 1'000'000'000;  ///< 1 to 10^9
  bool bigEndian = false;                   ///< byte order of what read() returns
};

/// Thread-bound; blocks as long as the counter's functions do. The caller waits between the readings.
class ClockAsker {
 public:
  explicit ClockAsker(std::unique_ptr<LatchedCounter> counter)
      : counter_(std::move(counter)) {}

  /// Reads the counter once and adds the reading to fit(), in nanoseconds. Returns false, and adds nothing, if the
  /// camera refuses or does not answer in time.
  bool ask();
  /// Returns how long to wait after the readings so far [ns]: 1/80 of their span, between 5 and 62.5 ms, so that a
  /// clock that was set is soon known, and that readings of all ages are in use: the old ones show the rate, the new
  /// ones the time.
  std::int64_t pause_ns() const;

  const ClockFit& fit() const { return fit_; }  ///< Returns the fit to all readings so far.

 private:
  std::unique_ptr<LatchedCounter> counter_;
  ClockFit fit_;
};

}  // namespace tractiond::capture
