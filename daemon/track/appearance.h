// How this picture's markers look: what the templates and the unmixing need, estimated from the markers themselves.
#pragma once

#include "daemon/track/centre.h"

#include <cstdint>
#include <span>
#include <vector>

namespace tractiond::track {

/// The template of a disc of radius `radius_px` in this plane, blurred as makes it fit the spots at `places` best:
/// least mean misfit, blur between 0.3 and 3 px. A few hundred places suffice. Allocates; takes some tens of
/// milliseconds.
MarkerTemplate fittingTemplate(const Plane& plane, double radius_px, const CrossTalk& crossTalk,
                               std::span<const Guess> places);

/// The templates of discs of which some are larger or smaller than the first, and which of them fits each place best.
struct Sizes {
  std::vector<MarkerTemplate> markers;  ///< the first is the typical one
  std::vector<std::uint8_t> of;         ///< by place, an index of `markers`
  double radius_px = 0.0;               ///< of the typical one
};

/// As fittingTemplate(), where discs differ from each other and from `radius_px`: from 0.4 to 1.8 times, in steps of 5
/// %. The typical one is that of the middle size. `seen`: by place, 1 where a disc was seen: these tell the middle
/// size, and at most `sample` of them the blur. Takes up to a second where sizes differ much.
Sizes fittingSizes(const Plane& plane, double radius_px, const CrossTalk& crossTalk, std::span<const Guess> places,
                   std::span<const std::uint8_t> seen, std::size_t sample);

/// A first template, for spots whose blur is not known yet.
MarkerTemplate roughTemplate(const Plane& plane, double radius_px);

/// Share of the amplitude in `own` that appears in `other` at the same places; the median, between 0 and 0.9. 0 without
/// places.
float crossTalkInto(const Plane& own, const Plane& other, const MarkerTemplate& marker, std::span<const Guess> places);

}  // namespace tractiond::track
