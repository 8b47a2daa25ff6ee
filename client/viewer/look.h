// Judges a picture of the camera before there is a gel file: brightness, sharpness, size of the markers.
#pragma once

#include "traction/control.h"

#include <array>
#include <cstdint>

namespace traction::view {

/// Numbers of one picture. Those of markers hold where most of the spots that stand out are of one size.
struct Look {
  static constexpr std::size_t kBins = 64;
  std::array<std::uint32_t, kBins> histogram{};  ///< of all levels of all channels, dark to bright
  double clipped = 0.0;                          ///< share of the levels that are the brightest or next to it
  double bright = 0.0;                           ///< level below which 99 % of all are, from 0 to 1
  /// Mean squared difference of neighbouring pixels over the variance of all: largest where the picture is sharpest.
  /// Compares pictures of one scene only.
  double sharpness = 0.0;
  int markers = 0;           ///< round spots of like size; 0: fewer than 16 are there, and the next two say nothing
  double diameter_px = 0.0;  ///< median, at half of their height
  double pitch_px = 0.0;     ///< median distance from one to the nearest, in the camera's pixels
};

/// Judges the picture; pixels are the camera's, also where it was reduced. Takes a tenth of a second for 5 million
/// pixels. Reentrant.
Look lookAt(const Snapshot& snapshot);

}  // namespace traction::view
