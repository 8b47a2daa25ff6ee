// Drift of the untouched picture from the zero.
#pragma once

#include <cstdint>

namespace tractiond {

/// Means over some seconds of frames in which nothing touched. Scale and roll are about the principal point.
struct RestDrift {
  std::int64_t seen_ns = 0;  ///< CLOCK_MONOTONIC of the last such frame; 0: none since the zero or the start
  double shiftU_px = 0.0;    ///< right
  double shiftV_px = 0.0;    ///< down
  double scale = 0.0;        ///< relative
  double roll = 0.0;         ///< [rad], u towards v
  double rms_px = 0.0;       ///< root mean square displacement of a coordinate without that motion
  bool isFollowed = false;   ///< it is taken off
};

}  // namespace tractiond
