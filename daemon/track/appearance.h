// Estimates the appearance of the markers in a picture (blur, size, cross-talk) from the markers themselves. Reentrant.
#pragma once

#include "daemon/track/centre.h"

#include <cstdint>
#include <span>
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

/// Sets the templates whose mean misfit at the spots at `places` is least, with one blur between 0.3 and 3 px, for
/// discs that differ from each other and from the layer's radius, by 0.6 to 1.6 times and more; and that radius. The
/// typical one is of the median size; the others are 0.38 to 1.8 times as large, in steps of 5 %. Where no disc is
/// found, or its size is far from most (dust), the typical one is used. Takes up to a second where sizes differ much.
/// \param seen by place, 1: a disc was seen; these determine the median, and some of them the blur
/// \return which template fits each place
std::vector<std::uint8_t> fitSizes(const Plane& plane, Appearance::Layer& layer, std::span<const Guess> places,
                                   std::span<const std::uint8_t> seen);

/// Returns the template of a disc of radius `radius_px` [px of the camera] with a blur of 0.9 px, for spots whose blur
/// is not known yet.
MarkerTemplate roughTemplate(const Plane& plane, double radius_px);

/// Estimates the share of a marker's amplitude in `own` that appears in `other` at the same place. Returns the median
/// over the places where a marker is found, limited to 0 to 0.9; 0 if none is found. Allocates.
/// \param own, other planes of the same picture
/// \param places guessed places of the markers of `own`
float crossTalkInto(const Plane& own, const Plane& other, const MarkerTemplate& marker, std::span<const Guess> places);

}  // namespace tractiond::track
