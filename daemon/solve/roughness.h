// Adds the roughness of contacts to the prior: the force of each atom, of any size, may differ by a share of the
// pressure beneath it.
#pragma once

#include "daemon/solve/selection.h"

namespace tractiond::solve {

/// Thread-bound. Allocates only when made.
class Roughness {
 public:
  /// `atoms` must outlive it.
  Roughness(const Atoms& atoms, const ModelOptions& options);

  /// Returns gamma of all atoms: that of the chosen ones, plus (rho q_a)^2 / 3 for every atom. q_a is the force of the
  /// atom under the harmonic mean of the pressure beneath it; an atom that is broader than the contact gets nothing.
  /// `mean_N`: of all atoms, 3A.
  std::span<const double> add(std::span<const double> mean_N, const Chosen& chosen);

 private:
  const double share_;  // rho
  const Atoms& atoms_;
  std::vector<double> peak_;                             // of each atom, its largest share of a point
  Eigen::SparseMatrix<double, Eigen::RowMajor> spread_;  // P x P, a pitch to and fro; the sum of a row is 1
  std::vector<double> pointForce_;                       // 3P
  std::vector<double> force_, pressure_;                 // P, magnitudes
  std::vector<double> gamma_;                            // A
};

}  // namespace tractiond::solve
