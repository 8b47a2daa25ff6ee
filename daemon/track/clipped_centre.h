// Sub-pixel centres of markers whose window leaves the picture while their disc does not.
#pragma once

#include "daemon/track/centre.h"

namespace tractiond::track {

/// Returns the least distance of a marker's centre from the outermost samples at which fitClippedCentre() finds it
/// [samples].
inline float clippedMargin(const MarkerTemplate& marker) {
  return static_cast<float>(marker.radius()) + 0.5F;
}

/// Fits a centre as fitCentres() does, from those samples of the window that the picture has. `centre` tells where the
/// search starts, and receives the result; its variance grows with the share of the window that is missing. Not found
/// where a part of the disc is outside the picture.
///
/// Takes some 20 us, fifty times as long as a centre whose window is whole: a gel has few of these markers.
/// Reentrant; allocates nothing.
void fitClippedCentre(const Plane& plane, const MarkerTemplate& marker, const CrossTalk& crossTalk, const Guess& guess,
                      Centre& centre);

/// As amplitudeAt().
float clippedAmplitudeAt(const Plane& plane, const MarkerTemplate& marker, float u, float v);

}  // namespace tractiond::track
