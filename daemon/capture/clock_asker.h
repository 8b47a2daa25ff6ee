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
  enum class Answer { kDone, kRefused, kNone };  ///< kNone: no answer in time

  virtual ~LatchedCounter() = default;
  virtual Answer latch() = 0;                                   ///< Makes the counter store its value.
  virtual Answer read(std::array<std::uint8_t, 8>& bytes) = 0;  ///< Reads the stored value, 64 bits.
  virtual std::int64_t rawNow() = 0;                            ///< Returns CLOCK_MONOTONIC_RAW of the host [ns].

  std::uint64_t perSecond = 1'000'000'000;  ///< 1 to 10^9
  bool bigEndian = false;                   ///< byte order of what read() returns
};

/// Thread-bound; blocks as long as the counter's functions do. The caller waits between the readings.
class ClockAsker {
 public:
  explicit ClockAsker(std::unique_ptr<LatchedCounter> counter)
      : counter_(std::move(counter)) {}

  /// Reads the counter once and adds the reading to fit(), in nanoseconds. Returns false if the camera refused or did
  /// not answer in time. Returns true but adds nothing if latching took more than 0.1 s: the command may have been
  /// repeated.
  bool ask();
  /// Returns how long to wait before the next ask() [ns]: see pauseAfter(); 1 s if the last one returned false; 0
  /// before the first.
  std::int64_t pause_ns() const { return pause_ns_; }
  /// Returns whether the camera refused three times in a row: its clock cannot be read. A camera that does not answer
  /// has not refused.
  bool isRefused() const { return refusals_ >= kRefusals; }

  /// Returns how long to wait after readings that were taken [ns]: 1/80 of their span, between 5 and 62.5 ms, so that a
  /// clock that was set is soon known, and that readings of all ages are in use: the old ones show the rate, the new
  /// ones the time.
  static std::int64_t pauseAfter(const ClockFit& fit);

  const ClockFit& fit() const { return fit_; }  ///< Returns the fit to all readings so far.

 private:
  static constexpr int kRefusals = 3;
  LatchedCounter::Answer question();

  std::unique_ptr<LatchedCounter> counter_;
  ClockFit fit_;
  int refusals_ = 0;
  std::int64_t pause_ns_ = 0;
};

}  // namespace tractiond::capture
