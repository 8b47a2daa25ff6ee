// Measures how long no frames have come.
#pragma once

#include "base/counter.h"

namespace tractiond {

/// Notes when a counter of frames advanced last, with the times that the caller passes, which must come from one clock.
/// Thread-bound. Keeps no reference to the counter. One made without arguments counts from time 0.
class FrameWatch {
 public:
  FrameWatch() = default;
  /// Begins at `now_ns` [ns] with the counter's present value.
  FrameWatch(const Counter& frames, std::int64_t now_ns)
      : frames_(frames.get())
      , at_ns_(now_ns) {}

  /// Returns for how long the counter has not advanced, by the times of the calls [ns]; 0 if it has advanced since the
  /// call before, or the construction.
  /// \param frames the same counter in each call
  std::int64_t idle_ns(const Counter& frames, std::int64_t now_ns) {
    if (frames_ != frames.get()) *this = {frames, now_ns};
    return now_ns - at_ns_;
  }

 private:
  std::uint64_t frames_ = 0;
  std::int64_t at_ns_ = 0;
};

}  // namespace tractiond
