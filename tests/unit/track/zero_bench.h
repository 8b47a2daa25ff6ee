// Frames and presses of the tests of zeros.
#pragma once

#include "tests/unit/track/scene.h"

namespace tractiond::track::zero_test {

inline constexpr int kZeroFrames = 30;

inline void shoot(Scene& scene, Tracking& tracking, int frames) {
  for (int i = 0; i < frames; ++i) tracking(scene.shoot());
}

inline Bump press(double peak_px) {
  Bump bump;
  bump.peak_px = {peak_px, 0.0};
  return bump;
}

}  // namespace tractiond::track::zero_test
