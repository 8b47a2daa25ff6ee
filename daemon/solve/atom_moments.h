// What is known of the forces of all atoms between two rounds.
#pragma once

#include <vector>

namespace tractiond::solve {

/// Posterior moments of the forces of all A atoms.
struct AtomMoments {
  std::vector<double> mean_N;    ///< 3A
  std::vector<double> known;     ///< A: degrees of freedom, 3 - tr(posterior covariance) / prior variance
  std::vector<double> noise_N2;  ///< A: variance of the mean by the picture's noise, sum of the components
};

/// Sizes the arrays for a number of atoms; sets all elements to 0.
inline void resize(AtomMoments& moments, int atoms) {
  moments.mean_N.assign(3 * atoms, 0.0);
  moments.known.assign(atoms, 0.0);
  moments.noise_N2.assign(atoms, 0.0);
}

}  // namespace tractiond::solve
