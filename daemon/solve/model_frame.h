// Tells which frames the model of an earlier one may answer.
#pragma once

#include "daemon/records/marker_field.h"

#include <cstdint>

namespace tractiond::solve {

/// The frame that a model was made of.
struct ModelFrame {
  FrameInfo info;
  Id zero{};

  /// Returns whether the model is in force for a later frame: of the same zero, at most 8 frames older, or 50 ms if
  /// that is longer.
  bool isInForce(const MarkerField& markers) const {
    constexpr std::uint64_t kMostFrames = 8;
    constexpr std::int64_t kLongest_ns = 50'000'000;
    if (markers.zero != zero || markers.info.frameNumber <= info.frameNumber) return false;
    return markers.info.frameNumber - info.frameNumber <= kMostFrames ||
           markers.info.times.received_ns - info.times.received_ns <= kLongest_ns;
  }
};

}  // namespace tractiond::solve
