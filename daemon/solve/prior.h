// Computes the prior of each atom from the moments of it and its neighbours: f_a ~ N(0, gamma_a Omega_a), a group ARD
// that follows the picture.
#pragma once

#include "daemon/solve/evidence.h"
#include "daemon/solve/selection.h"

#include <vector>

namespace tractiond::solve {

/// Returns the directions of an atom's force, a covariance of trace 3: those of `along`, and a share `turning` that is
/// isotropic.
inline Block directions(const Block& along, double turning) {
  const Block isotropic = Block::Identity();
  return (1.0 - turning) * 3.0 / along.trace() * along + turning * isotropic;
}

/// Thread-bound. Allocates only when made.
class Prior {
 public:
  Prior(const Atoms& atoms, const ModelOptions& options);

  /// Finds what is evident, e_a = max(0, |mean_a|^2 - z^2 noise_a / 3), for direct(). Returns whether anything is.
  bool see(const AtomMoments& moments);

  /// The same, and takes gamma_a = sum_b k_ab e_b / sum_b k_ab known_b, with
  /// k = exp(-r^2 / 2 (beta spacing)^2) within a level.
  bool follow(const AtomMoments& moments);

  /// [N^2], A.
  std::span<const double> gamma_N2() const { return gamma_; }

  /// Gives the chosen atoms the directions of what is evident around them: Omega = (1 - epsilon) 3 C / tr C + epsilon,
  /// C = sum_b exp(-r^2 / 2 l_a^2) e_b / |mean_b|^2 mean_b mean_b'. l_a is the markers' depth; with `wide`, half the
  /// distance of the level's atoms if that is more.
  void direct(Chosen& chosen, bool wide) const;

 private:
  const ModelOptions options_;
  Eigen::SparseMatrix<double, Eigen::RowMajor> near_;  // k, A x A
  Eigen::MatrixXd alike_;                              // exp(-r^2 / 2 l^2), A x A
  Eigen::MatrixXd wide_;         // the same of those atoms alone whose l_a is more than the depth, A x W
  std::vector<int> wideColumn_;  // A: column of wide_, or -1
  std::vector<double> evident_, gathered_, knownNear_;  // e, sum k e, sum k known
  std::vector<double> gamma_;
  std::vector<int> shown_;      // atoms with e > 0
  std::vector<Block> pulling_;  // of each of them, e / |mean|^2 mean mean'
};

}  // namespace tractiond::solve
