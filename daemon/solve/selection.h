// Selects the atoms of a round: those that are expected to move the markers most.
#pragma once

#include "daemon/solve/factors.h"

#include <span>
#include <vector>

namespace tractiond::solve {

/// The atoms of a round, f_a ~ N(0, gamma_a Omega_a).
struct Chosen {
  std::vector<int> atoms;            ///< indices, ascending
  std::vector<double> gamma_N2;      ///< of each: variance of a component
  std::vector<Block> covariance_N2;  ///< of each: gamma Omega

  /// Allocates memory for `most` atoms.
  void reserve(int most);
};

/// Thread-bound. Allocates only when made.
class Selection {
 public:
  /// Copies what it needs of `factors`.
  explicit Selection(const Factors& factors);

  /// Chooses atoms by their values gamma |H|^2 / 3 [px^2]: at most `most`, the largest ones, of those that exceed
  /// ModelConstants::kFloor times noise_px^2. Fills in their indices and gamma; leaves the covariances, which then
  /// belong to other atoms, unchanged. There may be no atom.
  /// \param gamma_N2 of all atoms (A)
  /// \param entering true: subtracts the value of the next atom, also from gamma, so that an atom enters with the
  /// variance 0 and no force jumps
  void choose(std::span<const double> gamma_N2, int most, bool entering, double noise_px, Chosen& chosen);

 private:
  std::vector<double> size_, value_;  // of each atom |H|^2 / 3 [px^2/N^2], and gamma times it
  std::vector<int> order_;
};

}  // namespace tractiond::solve
