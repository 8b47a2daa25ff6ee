// Computes the prior of each atom from the moments of it and its neighbours: f_a ~ N(0, gamma_a Omega_a), a group ARD
// that follows the picture.
#pragma once

#include "daemon/solve/atom_moments.h"
#include "daemon/solve/selection.h"

#include <vector>

namespace tractiond::solve {

/// Returns Omega, the covariance of an atom's force with the trace 3: `along`, scaled, with the weight 1 - epsilon,
/// and the identity with the weight epsilon (ModelConstants::kTurning). The trace of `along` must be above 0.
inline Block directions(const Block& along) {
  constexpr double kTurning = ModelConstants::kTurning;
  const Block isotropic = Block::Identity();
  return (1.0 - kTurning) * 3.0 / along.trace() * along + kTurning * isotropic;
}

/// Thread-bound. Allocates only when made.
class Prior {
 public:
  /// Copies what it needs of `atoms`.
  explicit Prior(const Atoms& atoms);

  /// Computes e_a = max(0, |mean_a|^2 - z^2 noise_a / 3) of all atoms, for direct(). Returns whether any is above 0.
  bool findEvident(const AtomMoments& moments);

  /// Does what findEvident() does; if the result is true, also computes gamma_a = sum_b k_ab e_b / sum_b k_ab known_b,
  /// with k = exp(-r^2 / 2 (beta spacing)^2) within a level. Otherwise gamma_N2() remains unchanged.
  bool findGamma(const AtomMoments& moments);

  /// Returns gamma of all atoms (A), by the last findGamma() that returned true.
  std::span<const double> gamma_N2() const { return gamma_; }

  /// Sets the covariances of the chosen atoms to gamma_a Omega_a, with gamma_a of `chosen`, not of gamma_N2(): Omega_a
  /// = (1 - epsilon) 3 C / tr C + epsilon, C = sum_b exp(-r^2 / 2 l_a^2) e_b / |mean_b|^2 mean_b mean_b', by the last
  /// findEvident() or findGamma(); 1 if C is 0. The covariance is 0 where gamma_a is 0. l_a is the depth of the
  /// markers.
  /// \param wide true: l_a is at least half the distance between the atoms of the level
  void direct(Chosen& chosen, bool wide) const;

 private:
  Eigen::SparseMatrix<double, Eigen::RowMajor> near_;  // k, A x A
  Eigen::MatrixXf alike_;                              // exp(-r^2 / 2 l^2), A x A
  Eigen::MatrixXf wide_;         // the same of those atoms alone whose l_a is more than the depth, A x W
  std::vector<int> wideColumn_;  // A: column of wide_, or -1
  std::vector<double> evident_, gathered_, knownNear_;  // e, sum k e, sum k known
  std::vector<double> gamma_;
  std::vector<int> shown_;      // atoms with e > 0
  std::vector<Block> pulling_;  // of each of them, e / |mean|^2 mean mean'
};

}  // namespace tractiond::solve
