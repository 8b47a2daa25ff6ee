// The reference of a follower: the pose from which displacements are measured, and the appearance of the markers.
#pragma once

#include "daemon/track/centre.h"
#include "daemon/track/lattice.h"

#include <cstdint>
#include <vector>

namespace tractiond::track {

/// Appearance of the markers in the picture. M is the number of markers.
struct Appearance {
  struct Layer {
    std::vector<MarkerTemplate> markers;  ///< the first is of the typical size; until they are learned a rough one
    CrossTalk crossTalk;                  ///< between this layer and the other one; 0 until it is learned
    double radius_px = 0.0;               ///< of the typical size; by the description until it is learned
  };
  bool isKnown = false;            ///< false: only the radii are valid
  std::vector<Layer> layers;       ///< in the order of the sensor's
  std::vector<std::uint8_t> size;  ///< M: which of its layer's templates fits the marker
};

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
