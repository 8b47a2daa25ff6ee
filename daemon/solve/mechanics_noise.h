// Noise by mechanics that are not exactly those of the gel (docs/mathematics.md, 4.1).
#pragma once

#include <cmath>
#include <span>

namespace tractiond::solve {

/// Returns the standard deviation of a coordinate by its own noise and by an error of the mechanics where the contact
/// is seen: sqrt(n^2 + e^2 sum d^4 / sum d^2) [px].
/// \param displacement_px d
/// \param noise_px n
/// \param mechanicsError e, relative error of the displacements
template <typename Number>
double noiseWithMechanics_px(std::span<const Number> displacement_px, double noise_px, double mechanicsError) {
  double second = 0.0, fourth = 0.0;
  for (const Number each : displacement_px) {
    const double squared = static_cast<double>(each) * static_cast<double>(each);
    second += squared;
    fourth += squared * squared;
  }
  if (!(second > 0.0)) return noise_px;
  return std::sqrt(noise_px * noise_px + mechanicsError * mechanicsError * fourth / second);
}

}  // namespace tractiond::solve
