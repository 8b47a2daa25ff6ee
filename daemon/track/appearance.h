// How this picture's markers look: what the templates and the unmixing need, estimated from the markers themselves.
#pragma once

#include "daemon/track/centre.h"

#include <span>

namespace tractiond::track {

/// The template of a disc of radius `radius_px` in this plane, blurred as makes it fit the spots at `places` best:
/// least mean misfit, blur between 0.3 and 3 px. A few hundred places suffice. Allocates; takes some tens of
/// milliseconds.
MarkerTemplate fittingTemplate(const Plane& plane, double radius_px, const CrossTalk& crossTalk,
                               std::span<const Guess> places);

/// A first template, for spots whose blur is not known yet.
MarkerTemplate roughTemplate(const Plane& plane, double radius_px);

/// Share of the amplitude in `own` that appears in `other` at the same places; the median, between 0 and 0.9. 0 without
/// places.
float crossTalkInto(const Plane& own, const Plane& other, const MarkerTemplate& marker, std::span<const Guess> places);

}  // namespace tractiond::track
