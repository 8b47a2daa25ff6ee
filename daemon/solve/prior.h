// What is expected of each atom, from what was seen of it and its neighbours: f_a ~ N(0, gamma_a Omega_a), a group ARD
// that follows the picture.
#pragma once

#include "daemon/solve/evidence.h"

#include <vector>

namespace tractiond::solve {

/// The atoms that take part in a round.
struct Chosen {
  std::vector<int> atoms;
  std::vector<double> gamma_N2;      ///< variance of a component
  std::vector<Block> covariance_N2;  ///< gamma Omega

  void reserve(int most);
};

/// Puts the indices of the `most` largest values first, falling, in `order`, which holds all indices in any order.
void orderLargest(std::span<const double> values, int most, std::vector<int>& order);

/// Thread-bound. Allocates only when made.
class Prior {
 public:
  /// Both must outlive it.
  Prior(const Factors& factors, const Atoms& atoms, const ModelOptions& options);

  /// Takes e_a = max(0, |mean_a|^2 - z^2 noise_a / 3) and gamma_a = sum_b k_ab e_b / sum_b k_ab known_b, with
  /// k = exp(-r^2 / 2 (beta spacing)^2) within a level. Returns whether anything is evident.
  bool follow(const Seen& seen);

  /// Chooses the `most` largest gamma |H|^2 / 3, less the next one's, so that an atom enters at nothing.
  void select(int most, double noise_px, Chosen& chosen);

  /// Gives the chosen atoms the directions of what is evident around them: Omega = (1 - epsilon) 3 C / tr C + epsilon,
  /// C = sum_b exp(-r^2 / 2 l^2) e_b / |mean_b|^2 mean_b mean_b'.
  void direct(Chosen& chosen) const;

 private:
  const ModelOptions options_;
  std::vector<double> size_;                            // |H|^2 / 3 of each atom
  Eigen::SparseMatrix<double, Eigen::RowMajor> near_;   // k, A x A
  Eigen::MatrixXd alike_;                               // exp(-r^2 / 2 l^2), A x A
  std::vector<double> evident_, gathered_, knownNear_;  // e, sum k e, sum k known
  std::vector<double> gamma_, value_;
  std::vector<int> order_;
  std::vector<int> shown_;      // atoms with e > 0
  std::vector<Block> pulling_;  // of each of them, e / |mean|^2 mean mean'
};

}  // namespace tractiond::solve
