// The start: all atoms alike. Their force is f ~ N(0, tau^2), and the evidence of the picture's amplitudes c in the
// modes s says what tau is:
//   -1/2 sum [ln(s^2 tau^2 + n^2) + c^2 / (s^2 tau^2 + n^2)]
#pragma once

#include "daemon/solve/factors.h"

#include <span>
#include <vector>

namespace tractiond::solve {

/// What is thought of all A atoms.
struct Seen {
  std::vector<double> mean_N;    ///< 3A
  std::vector<double> known;     ///< A: share of its prior's variance that the picture takes off, sum of the components
  std::vector<double> noise_N2;  ///< A: variance of the mean by the picture's noise, sum of the components
};

/// Sizes the arrays.
void resize(Seen& seen, int atoms);

/// |mean|^2 of an atom.
inline double squaredMean(const Seen& seen, int atom) {
  return Eigen::Vector3d::Map(seen.mean_N.data() + 3 * static_cast<std::ptrdiff_t>(atom)).squaredNorm();
}

/// e of an atom: |mean|^2 as far as it is evident, `surety` deviations above the noise.
inline double evident(const Seen& seen, int atom, double surety) {
  return std::max(0.0, squaredMean(seen, atom) - surety * surety * seen.noise_N2[static_cast<std::size_t>(atom)] / 3.0);
}

/// Thread-bound. Allocates only when made.
class Evidence {
 public:
  /// Both must outlive it.
  Evidence(const Factors& factors, const Atoms& atoms, const ModelOptions& options);

  /// Returns tau, the force that is usual in this picture [N]. `amplitudes`: r [px].
  double usualForce_N(std::span<const double> amplitudes, double noise_px) const;

  /// Fills `seen` with what the amplitudes say of every atom if that force is usual.
  void start(std::span<const double> amplitudes, double noise_px, Seen& seen);

  /// amplitudes -= those of `forces_N` of the points, 3P.
  void subtract(std::span<const double> forces_N, std::span<double> amplitudes);

 private:
  int likeliest(std::span<const double> amplitudes, double noise_px) const;

  const Factors& factors_;
  const Atoms& atoms_;
  // For each tau / n: of every mode 1 / (s^2 tau^2 / n^2 + 1), and the sum of the logarithms; of every atom what is
  // known of it, and the noise of its mean at 1 px.
  std::vector<double> ratios_;
  Eigen::MatrixXd unexplained_;  // r x ratios
  std::vector<double> logarithms_;
  Eigen::MatrixXd known_, noise_;  // A x ratios
  // Of one picture.
  std::vector<int> everyPoint_;      // 0 .. 3P-1
  LineArray<double> filtered_;       // of each mode [N], padded
  std::vector<double> pointMean_;    // 3P [N]
  std::vector<float> coefficients_;  // 3P
};

}  // namespace tractiond::solve
