// Fits sub-pixel centres of markers by Gauss-Newton steps of the matched template, from a guess.
#pragma once

#include "daemon/track/marker_template.h"
#include "daemon/track/plane.h"

#include <span>

namespace tractiond::track {

/// Start of a fit.
struct Guess {
  float u = 0.0F, v = 0.0F;            ///< px
  float minAmplitude = 0.0F;           ///< least amplitude of a marker [levels]
  bool mixed = false;                  ///< true: a marker of the other colour is near; its cross-talk is removed
  std::uint8_t size = 0;               ///< index of the template
  float slopeU = 0.0F, slopeV = 0.0F;  ///< of the surroundings' brightness [levels / px]
};

/// Result of a fit. If not found, only u, v and the amplitude of the last step have a meaning.
struct Centre {
  float u = 0.0F, v = 0.0F;            ///< px; if not found, where the search ended
  float amplitude = 0.0F;              ///< levels above the surroundings; below them where the plane's markers are dark
  float misfit = 0.0F;                 ///< mean square residual of the template, as of plain samples [levels^2]
  float blurred = 0.0F;                ///< root of the sum of squares that more or less blur would explain [levels]
  float variance = 0.0F;               ///< of u and of v for unit noise [px^2 / level^2], if the guessed slope is right
  float slopeU = 0.0F, slopeV = 0.0F;  ///< of the surroundings, as this window shows it [levels / px]
  float slopeVariance = 0.0F;          ///< of the two for unit noise [1 / px^2]
  float slopeShare = 0.0F;             ///< added to the variance if the guessed slope was as uncertain as this window's
  float level = 0.0F;                  ///< brightness half-way up the marker's rim, where its place is seen [levels]
  bool found = false;                  ///< the steps converged, amplitude >= minAmplitude, disc within the picture
};

/// Cross-talk: shares of colours that appear in the wrong channel.
struct CrossTalk {
  float own = 0.0F;    ///< of this plane's colour in the other one's channel
  float other = 0.0F;  ///< of the other colour in this plane
};

/// Fits one centre per guess, each with the template that its `size` names. If the plane's markers are dark, amplitudes
/// and slopes are those of its negative. A marker is found from about its own radius away. At the picture's border
/// fitClippedCentre() continues. Reentrant; allocates nothing.
/// \param crossTalk used for guesses that are `mixed`
/// \param centres as many as guesses; all are written
void fitCentres(const Plane& plane, std::span<const MarkerTemplate> markers, const CrossTalk& crossTalk,
                std::span<const Guess> guesses, std::span<Centre> centres);

/// Does the same for all guesses with one template; Guess::size must be 0.
inline void fitCentres(const Plane& plane, const MarkerTemplate& marker, const CrossTalk& crossTalk,
                       std::span<const Guess> guesses, std::span<Centre> centres) {
  fitCentres(plane, {&marker, 1}, crossTalk, guesses, centres);
}

/// Returns the template's amplitude at this place [px, rounded to 1/8 sample] in levels, without steps, for
/// surroundings without a slope; below 0 where the place is on the wrong side of its surroundings for this plane's
/// markers. Returns 0 if a part of the disc is outside the picture. Reentrant; allocates nothing.
float amplitudeAt(const Plane& plane, const MarkerTemplate& marker, float u, float v);

}  // namespace tractiond::track
