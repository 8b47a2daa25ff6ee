// Selects the atoms of a round: those that are expected to move the markers most.
#pragma once

#include "daemon/solve/factors.h"

#include <span>
#include <vector>

namespace tractiond::solve {

/// The atoms of a round, f_a ~ N(0, gamma_a Omega_a), rising.
struct Chosen {
  std::vector<int> atoms;
  std::vector<double> gamma_N2;      ///< variance of a component
  std::vector<Block> covariance_N2;  ///< gamma Omega

  void reserve(int most);
};

/// Thread-bound. Allocates only when made.
class Selection {
 public:
  Selection(const Factors& factors, const ModelOptions& options);

  /// Chooses the atoms with the `most` largest gamma |H|^2 / 3 that are above the floor. With `entering` it subtracts
  /// the value of the next one, from gamma too, so that an atom enters with variance 0 and no force jumps.
  void choose(std::span<const double> gamma_N2, int most, bool entering, double noise_px, Chosen& chosen);

 private:
  const double floor_;                // [n^2]
  std::vector<double> size_, value_;  // of each atom |H|^2 / 3 [px^2/N^2], and gamma times it
  std::vector<int> order_;
};

}  // namespace tractiond::solve
