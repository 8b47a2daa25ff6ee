// A contact is rougher than its atoms say: each atom of any size is expected to differ by a share of the pressure that
// is beneath it.
#pragma once

#include "daemon/solve/prior.h"

namespace tractiond::solve {

/// Thread-bound. Allocates only when made.
class Roughness {
 public:
  /// Both must outlive it.
  Roughness(const Factors& factors, const Atoms& atoms, const ModelOptions& options);

  /// Adds (rho q_a)^2 / 3 to gamma of every atom, q_a being the force that the atom would have under the harmonic mean
  /// of the pressure beneath it, so that what is broader than the contact gets nothing; chooses the `most` largest
  /// gamma |H|^2 of all. `mean_N`: of all atoms, 3A.
  void add(std::span<const double> mean_N, int most, double noise_px, Chosen& chosen);

 private:
  const ModelOptions options_;
  const Atoms& atoms_;
  std::vector<double> size_;                             // |H|^2 / 3 of each atom
  std::vector<double> peak_;                             // of each atom, its largest share of a point
  Eigen::SparseMatrix<double, Eigen::RowMajor> spread_;  // P x P, a pitch to and fro; the sum of a row is 1
  std::vector<double> pointForce_;                       // 3P
  std::vector<double> force_, pressure_;                 // P, magnitudes
  std::vector<double> gamma_, value_;                    // A
  std::vector<int> order_;
};

}  // namespace tractiond::solve
