// Fits centres by least squares over the samples, for the few markers that the tables of a MarkerTemplate do not cover:
// those whose window leaves the picture, and those whose disc is deformed.
#pragma once

#include "daemon/track/centre.h"

namespace tractiond::track {

/// Returns the least distance of a marker's centre from the outermost samples at which fitClippedCentre() finds it
/// [samples]; with a mixed guess on a Bayer mosaic it is one more.
inline float clippedMargin(const MarkerTemplate& marker) {
  return static_cast<float>(marker.radius()) + 0.5F;
}

/// Fits a centre as fitCentres() does, from those samples of the window that the picture has. Sets `found`, which must
/// be false before, if the steps settle, the amplitude is at least that of the guess, and the whole disc is in the
/// picture. Takes 10 to 40 us per step, a hundred times as long as a centre whose window is whole. Reentrant; allocates
/// nothing.
/// \param centre start of the search, and its result; the variance grows with the missing share of the window
void fitClippedCentre(const Plane& plane, const MarkerTemplate& marker, const CrossTalk& crossTalk, const Guess& guess,
                      Centre& centre);

/// Returns the same as amplitudeAt(), from those samples of the window that the picture has; 0 if a part of the disc is
/// outside.
float clippedAmplitudeAt(const Plane& plane, const MarkerTemplate& marker, float u, float v);

/// Fits a centre as fitCentres() does, but the disc may be larger or smaller than the template's, and an ellipse.
/// Returns false and leaves `centre` as it is if the steps do not settle, the amplitude falls below that of the guess,
/// or a part of the disc is outside the picture. Takes 20 to 100 us. Reentrant; allocates nothing.
/// \param centre start of the search; receives place, amplitude, misfit, and the variance with all slopes unknown
/// (slopeShare 0)
bool fitDeformedCentre(const Plane& plane, const MarkerTemplate& marker, const CrossTalk& crossTalk, const Guess& guess,
                       Centre& centre);

}  // namespace tractiond::track
