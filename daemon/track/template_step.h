// What the products of a window with a template's functions tell of the marker.
#pragma once

#include "daemon/track/centre.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace tractiond::track {

// The functions are parts of loops that are compiled for each machine.
#define TRACTION_INLINE inline __attribute__((always_inline))

/// Products with the orthonormal functions but the constant; of markers that are darker than their surroundings,
/// negated.
using WindowProducts = std::array<float, MarkerTemplate::kRows>;

/// A Gauss-Newton step to the marker's place.
struct TemplateStep {
  float amplitude;  ///< [levels]; if it is not above 0, the rest has no meaning
  float du, dv;     ///< [samples], in each direction at most `longest`
  float size;       ///< the larger of the two before they were shortened
};

/// \param slopeU, slopeV known slope of the surroundings [levels / sample]
TRACTION_INLINE TemplateStep stepOf(const MarkerTemplate::Phase& phase, const WindowProducts& p, float slopeU,
                                    float slopeV, float longest) {
  const auto& solve = phase.solve;
  const auto& lean = phase.lean;
  TemplateStep step;
  step.amplitude = solve[0] * p[0] + solve[1] * p[1] + solve[2] * p[2] - lean[0] * slopeU - lean[1] * slopeV;
  step.du = (solve[3] * p[1] + solve[4] * p[2] - lean[2] * slopeU - lean[3] * slopeV) / step.amplitude;
  step.dv = (solve[5] * p[2] - lean[4] * slopeU - lean[5] * slopeV) / step.amplitude;
  step.size = std::max(std::abs(step.dv), std::abs(step.du));
  if (step.size > longest) {
    step.du *= longest / step.size;
    step.dv *= longest / step.size;
  }
  return step;
}

/// Sets what is known of a centre that was found, but its place.
/// \param noise variance of the samples, relative to that of plain ones
/// \param misfit, mean of the window's samples
TRACTION_INLINE void describeFound(const Plane& plane, const MarkerTemplate::Phase& phase, const WindowProducts& p,
                                   float noise, float misfit, float mean, Centre& centre) {
  const float perVariance = noise * plane.scale * plane.scale / (centre.amplitude * centre.amplitude);
  const float inverseScale = 1.0F / plane.scale;
  centre.misfit = misfit;
  centre.variance = phase.variance * perVariance;
  centre.blurred = p[3];
  centre.slopeShare = phase.slopeShare * perVariance;
  centre.slopeU = (phase.solveSlope[0] * p[4] + phase.solveSlope[1] * p[5]) * inverseScale;
  centre.slopeV = phase.solveSlope[2] * p[5] * inverseScale;
  centre.slopeVariance = phase.slopeVariance * noise * inverseScale * inverseScale;
  centre.level = mean + (0.5F - phase.cover) * plane.sign * centre.amplitude;
  centre.found = true;
}

}  // namespace tractiond::track
