// Starts the rounds with the same prior for all atoms, f ~ N(0, tau^2). tau maximises the evidence of the picture's
// amplitudes c in the modes s:
//   -1/2 sum [ln(s^2 tau^2 + n^2) + c^2 / (s^2 tau^2 + n^2)]
// The modes are read in groups (ModelOptions::groups), as long as forces of that size are visible in the next group:
// its strongest mode has s tau >= epsilon n, where epsilon is ModelOptions::visible. Groups in which the final tau is
// not visible are left out.
#pragma once

#include "daemon/solve/factors.h"

#include <span>
#include <vector>

namespace tractiond::solve {

/// Posterior moments of the forces of all A atoms.
struct AtomMoments {
  std::vector<double> mean_N;    ///< 3A
  std::vector<double> known;     ///< A: degrees of freedom, 3 - tr(posterior covariance) / prior variance
  std::vector<double> noise_N2;  ///< A: variance of the mean by the picture's noise, sum of the components
};

/// Sizes the arrays for a number of atoms; sets all elements to 0.
void resize(AtomMoments& moments, int atoms);

/// Returns |mean|^2 of an atom [N^2].
inline double squaredMean(const AtomMoments& moments, int atom) {
  return Eigen::Vector3d::Map(moments.mean_N.data() + 3 * static_cast<std::ptrdiff_t>(atom)).squaredNorm();
}

/// Returns e of an atom [N^2]: |mean|^2 - surety^2 noise / 3, but at least 0.
inline double evident(const AtomMoments& moments, int atom, double surety) {
  return std::max(0.0, squaredMean(moments, atom) -
                           surety * surety * moments.noise_N2[static_cast<std::size_t>(atom)] / 3.0);
}

/// Thread-bound. Allocates only when made.
class Evidence {
 public:
  /// `factors` and `atoms` must outlive it.
  Evidence(const Factors& factors, const Atoms& atoms, const ModelOptions& options);

  /// Returns how many modes a frame needs: as many as `amplitudes` has, or those of one more group; without amplitudes,
  /// those of the first group. \param amplitudes c
  /// of the modes that were read [px]
  int modesToRead(std::span<const double> amplitudes, double noise_px);

  /// Returns tau, the typical force of this picture [N]. \param amplitudes c of the modes that were read [px], at least
  /// one
  double typicalForce_N(std::span<const double> amplitudes, double noise_px);

  /// Computes the moments of all atoms from the amplitudes, with the prior of their typicalForce_N(). \param amplitudes
  /// as many as modesToRead() asks for
  void start(std::span<const double> amplitudes, double noise_px, AtomMoments& moments);

  /// Subtracts from the amplitudes (r [px]) those that the forces of the points (3P) cause.
  void subtract(std::span<const double> forces_N, std::span<double> amplitudes);

 private:
  int likeliest(std::span<const double> amplitudes, double noise_px);
  int lastVisible(int ratio) const;

  const Factors& factors_;
  const Atoms& atoms_;
  const double visible_;
  std::vector<int> ends_;  // of the groups of modes
  // For each tau / n: 1 / (s^2 tau^2 / n^2 + 1) of every mode, and the sum of the logarithms up to it; of every atom
  // AtomMoments::known, and noise_N2 at 1 px, by the visible groups.
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
