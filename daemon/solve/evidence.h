// Starts the rounds with all atoms alike: f ~ N(0, tau^2), with the tau that maximises the evidence of the picture's
// amplitudes c in the modes s:
//   -1/2 sum [ln(s^2 tau^2 + n^2) + c^2 / (s^2 tau^2 + n^2)]
// The modes are read in groups (ModelOptions::groups), as long as the next group's strongest has s tau >= epsilon n,
// epsilon being ModelOptions::visible; the start leaves out the groups of which that is not so with the last tau.
#pragma once

#include "daemon/solve/factors.h"

#include <span>
#include <vector>

namespace tractiond::solve {

/// What is known of the forces of all A atoms.
struct AtomMoments {
  std::vector<double> mean_N;    ///< 3A
  std::vector<double> known;     ///< A: degrees of freedom, 3 - tr(posterior covariance) / prior variance
  std::vector<double> noise_N2;  ///< A: variance of the mean by the picture's noise, sum of the components
};

/// Sizes the arrays for so many atoms, all 0.
void resize(AtomMoments& moments, int atoms);

/// Returns |mean|^2 of an atom [N^2].
inline double squaredMean(const AtomMoments& moments, int atom) {
  return Eigen::Vector3d::Map(moments.mean_N.data() + 3 * static_cast<std::ptrdiff_t>(atom)).squaredNorm();
}

/// Returns e of an atom: how far |mean|^2 exceeds `surety` deviations of the noise; 0 if it does not.
inline double evident(const AtomMoments& moments, int atom, double surety) {
  return std::max(0.0, squaredMean(moments, atom) -
                           surety * surety * moments.noise_N2[static_cast<std::size_t>(atom)] / 3.0);
}

/// Thread-bound. Allocates only when made.
class Evidence {
 public:
  /// Both must outlive it.
  Evidence(const Factors& factors, const Atoms& atoms, const ModelOptions& options);

  /// Returns how many modes are to be read of a picture, `amplitudes` [px] being those that were: as many, or a group
  /// more.
  int modesToRead(std::span<const double> amplitudes, double noise_px);

  /// Returns tau, the typical force of this picture [N], by the amplitudes [px] of its first modes.
  double typicalForce_N(std::span<const double> amplitudes, double noise_px);

  /// Fills `moments` from the amplitudes with that typical force. modesToRead() must be satisfied.
  void start(std::span<const double> amplitudes, double noise_px, AtomMoments& moments);

  /// Subtracts the amplitudes that the points' forces `forces_N` (3P) cause.
  void subtract(std::span<const double> forces_N, std::span<double> amplitudes);

 private:
  int likeliest(std::span<const double> amplitudes, double noise_px);
  int lastVisible(int ratio) const;

  const Factors& factors_;
  const Atoms& atoms_;
  const double visible_;
  std::vector<int> ends_;  // of the groups of modes
  // For each tau / n: of every mode 1 / (s^2 tau^2 / n^2 + 1), and the sum of the logarithms up to it; of every atom
  // what the groups that are visible tell of it, and the noise of its mean at 1 px.
  std::vector<double> ratios_;
  std::vector<int> used_;                     // modes of the visible groups
  Eigen::MatrixXd unexplained_, logarithms_;  // r x ratios
  Eigen::MatrixXd known_, noise_;             // A x ratios
  // Of one picture.
  std::vector<int> everyPoint_;      // 0 .. 3P-1
  std::vector<double> power_;        // r: squared amplitudes [px^2]
  LineArray<double> filtered_;       // of each mode [N], padded
  std::vector<double> pointMean_;    // 3P [N]
  std::vector<float> coefficients_;  // 3P
};

}  // namespace tractiond::solve
