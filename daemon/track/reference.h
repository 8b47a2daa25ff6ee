// The reference of a follower: the pose from which displacements are measured, and the appearance of the markers.
#pragma once

#include "daemon/track/appearance.h"
#include "daemon/track/lattice.h"

#include <cstdint>
#include <vector>

namespace tractiond::track {

/// Pose of M markers, in the order of sensor::markerPositions.
struct Reference {
  bool isZero = false;                ///< false: the first labelled picture stands in for a zero
  std::vector<Vector> place_px;       ///< M
  std::vector<float> amplitude;       ///< M [levels]
  std::vector<std::uint8_t> present;  ///< M, 0 or 1
  int isolatedGaps = 0;               ///< see MarkerField
  Appearance appearance;
};

}  // namespace tractiond::track
