// Asks a camera what its clock shows, and learns from the answers.
#pragma once

#include "daemon/capture/clock_fit.h"

#include <array>
#include <cstdint>
#include <functional>
#include <utility>

namespace tractiond::capture {

/// A camera's counter that can be latched: it stores what it shows at that moment, to be read afterwards.
struct LatchedCounter {
  enum class Answer { kDone, kRefused, kNone };
  std::function<Answer()> latch;
  std::function<Answer(std::array<std::uint8_t, 8>& bytes)> read;
  std::uint64_t perSecond = 1'000'000'000;  ///< 1 to 10^9
  bool bigEndian = false;
};

/// Thread-bound; waits as long as the counter's functions do. Knows when to ask again, and leaves the waiting to
/// others.
class ClockAsker {
 public:
  /// \param rawNow CLOCK_MONOTONIC_RAW, or what takes its place in tests
  ClockAsker(LatchedCounter counter, std::function<std::int64_t()> rawNow)
      : counter_(std::move(counter))
      , rawNow_(std::move(rawNow)) {}

  /// Asks once. False: the camera gave no answer, or none that is one.
  bool ask();
  /// After the answer before. Often until the drift is known, then eight times a second; seldom where none came.
  std::int64_t pause_ns() const { return pause_ns_; }
  /// The camera refused three times in a row: it cannot be asked. One that is silent may answer again.
  bool isRefused() const { return refusals_ >= kRefusals; }

  const ClockFit& fit() const { return fit_; }

 private:
  static constexpr int kRefusals = 3;
  LatchedCounter::Answer question();

  LatchedCounter counter_;
  std::function<std::int64_t()> rawNow_;
  ClockFit fit_;
  int refusals_ = 0;
  std::int64_t pause_ns_ = 0;
};

}  // namespace tractiond::capture
