// Estimates sub-pixel centres: Gauss-Newton steps of the matched template, from a guess.
#pragma once

#include "daemon/track/marker_template.h"
#include "daemon/track/plane.h"

#include <span>

namespace tractiond::track {

/// Where a marker is expected.
struct Guess {
  float u = 0.0F, v = 0.0F;            ///< px
  float minAmplitude = 0.0F;           ///< levels; below it there is no marker
  bool mixed = false;                  ///< a marker of the other colour is near, whose cross-talk is removed
  std::uint8_t size = 0;               ///< index of the template
  float slopeU = 0.0F, slopeV = 0.0F;  ///< of the surroundings' brightness [levels / px]
};

/// What was found.
struct Centre {
  float u = 0.0F, v = 0.0F;            ///< px; if not found, where the search ended
  float amplitude = 0.0F;              ///< levels above the surroundings; below them for dark markers
  float misfit = 0.0F;                 ///< mean square of the residuals, as for plain samples [levels^2]
  float blurred = 0.0F;                ///< root of the sum of squares that more or less blur would explain [levels]
  float variance = 0.0F;               ///< of u and of v for unit noise, if the guessed slope is right [px^2 / level^2]
  float slopeU = 0.0F, slopeV = 0.0F;  ///< of the surroundings, in this window [levels / px]
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

/// Estimates one centre per guess, with the template that the guess names. For dark markers, amplitudes and slopes are
/// those of the negative. A guess may be wrong by about the marker's radius. Reentrant; allocates nothing.
void fitCentres(const Plane& plane, std::span<const MarkerTemplate> markers, const CrossTalk& crossTalk,
                std::span<const Guess> guesses, std::span<Centre> centres);

/// The same with one template for all.
inline void fitCentres(const Plane& plane, const MarkerTemplate& marker, const CrossTalk& crossTalk,
                       std::span<const Guess> guesses, std::span<Centre> centres) {
  fitCentres(plane, {&marker, 1}, crossTalk, guesses, centres);
}

/// Returns the template's amplitude at exactly this place; 0 if a part of the disc is outside the picture.
float amplitudeAt(const Plane& plane, const MarkerTemplate& marker, float u, float v);

}  // namespace tractiond::track
