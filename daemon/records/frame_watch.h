// Measures how long no frames have come.
#pragma once

#include "base/counter.h"

namespace tractiond {

/// Notes when a counter of frames advanced last. Thread-bound.
class FrameWatch {
 public:
  FrameWatch() = default;
  FrameWatch(const Counter& frames, std::int64_t now_ns)
      : frames_(frames.get())
      , at_ns_(now_ns) {}

  /// Returns for how long the counter has been seen not to advance, by the times of the calls [ns].
  std::int64_t idle_ns(const Counter& frames, std::int64_t now_ns) {
    if (frames_ != frames.get()) *this = {frames, now_ns};
    return now_ns - at_ns_;
  }

 private:
  std::uint64_t frames_ = 0;
  std::int64_t at_ns_ = 0;
};

}  // namespace tractiond
