// Estimates the appearance of the markers from a picture: templates, and the cross-talk of the colours.
#pragma once

#include "daemon/track/centre.h"

#include <cstdint>
#include <span>
#include <vector>

namespace tractiond::track {

/// Returns the template of a disc of radius `radius_px` in this plane, with the blur (0.3 to 3 px) that fits the spots
/// at `places` with the least mean misfit. A few hundred places suffice. Allocates; takes some tens of milliseconds.
MarkerTemplate fittingTemplate(const Plane& plane, double radius_px, const CrossTalk& crossTalk,
                               std::span<const Guess> places);

/// Templates of discs of different sizes, and for each place the one that fits best.
struct Sizes {
  std::vector<MarkerTemplate> markers;  ///< the first is the typical one
  std::vector<std::uint8_t> of;         ///< by place, index into `markers`
  double radius_px = 0.0;               ///< of the typical one
};

/// Like fittingTemplate(), for discs that differ from each other and from `radius_px`: by factors of 0.4 to 1.8, in
/// steps of 5 %. The typical template has the median size. \param seen by place, 1 if a disc was seen: these determine
/// the median size, and at most `sample` of them the blur. Takes up to a second if sizes differ much.
Sizes fittingSizes(const Plane& plane, double radius_px, const CrossTalk& crossTalk, std::span<const Guess> places,
                   std::span<const std::uint8_t> seen, std::size_t sample);

/// Returns a first template, for spots whose blur is not known yet.
MarkerTemplate roughTemplate(const Plane& plane, double radius_px);

/// Returns the share of the amplitude in `own` that appears in `other` at the same places: the median, between 0 and
/// 0.9; 0 without places.
float crossTalkInto(const Plane& own, const Plane& other, const MarkerTemplate& marker, std::span<const Guess> places);

}  // namespace tractiond::track
