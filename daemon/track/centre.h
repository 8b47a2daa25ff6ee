// Sub-pixel centres: Gauss-Newton steps of the matched template, from a guess.
#pragma once

#include "daemon/track/marker_template.h"
#include "daemon/track/plane.h"

#include <span>

namespace tractiond::track {

/// Where to look.
struct Guess {
  float u = 0.0F, v = 0.0F;            ///< px
  float minAmplitude = 0.0F;           ///< levels; below, there is no marker here
  bool mixed = false;                  ///< a marker of the other colour is near: take its cross-talk out
  std::uint8_t size = 0;               ///< which of the templates
  float slopeU = 0.0F, slopeV = 0.0F;  ///< of the surroundings' brightness [levels / px]
};

/// What is there.
struct Centre {
  float u = 0.0F, v = 0.0F;  ///< px; where not found, where the search ended
  float amplitude = 0.0F;    ///< levels above the surroundings; below them where the plane's markers are dark
  float misfit = 0.0F;       ///< mean square of what the template does not explain, as of plain samples [levels^2]
  float blurred = 0.0F;      ///< root of the sum of squares that more or less blur would explain [levels]
  float variance = 0.0F;     ///< of u and of v for unit noise [px^2 / level^2], the guessed slope being right
  float slopeU = 0.0F, slopeV = 0.0F;  ///< of the surroundings, as this window shows it [levels / px]
  float slopeVariance = 0.0F;          ///< of the two for unit noise [1 / px^2]
  float slopeShare = 0.0F;             ///< added to the variance if the guessed slope was as uncertain as this window's
  float level = 0.0F;                  ///< brightness half-way up the marker's rim, where its place is seen [levels]
  bool found = false;                  ///< the steps settled, amplitude >= minAmplitude, disc within the picture
};

/// Shares of colours seen in the wrong channel.
struct CrossTalk {
  float own = 0.0F;    ///< of this plane's colour in the other one's channel
  float other = 0.0F;  ///< of the other colour in this plane
};

/// One centre per guess, each with the template that it names. Where the plane's markers are dark, amplitudes and
/// slopes are those of its negative. A marker is caught from about its own radius away. Reentrant; allocates nothing.
void fitCentres(const Plane& plane, std::span<const MarkerTemplate> markers, const CrossTalk& crossTalk,
                std::span<const Guess> guesses, std::span<Centre> centres);

/// All with one template.
inline void fitCentres(const Plane& plane, const MarkerTemplate& marker, const CrossTalk& crossTalk,
                       std::span<const Guess> guesses, std::span<Centre> centres) {
  fitCentres(plane, {&marker, 1}, crossTalk, guesses, centres);
}

/// The template's amplitude at exactly this place, no steps. 0 where a part of the disc is outside the picture.
float amplitudeAt(const Plane& plane, const MarkerTemplate& marker, float u, float v);

}  // namespace tractiond::track
