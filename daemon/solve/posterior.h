// Computes the posterior of the chosen atoms from a picture and their prior.
//
//   gamma Omega = S S',  B = [H S, P Q^1/2],  A = B'B + n^2     over the coordinates that are there
//   x = A^-1 B'd         the atoms' forces being f = S x, the motion's own 4 unknowns last
//   Sigma = n^2 S A^-1 S'                       covariance of f
//   known_a = 3 - tr Sigma_aa / gamma_a         degrees of freedom
//   noise_a = n^2 tr [S (A^-1 - n^2 A^-2) S']_aa    variance of f by the picture's noise
#pragma once

#include "daemon/solve/prior.h"

#include <array>
#include <span>
#include <vector>

namespace tractiond::solve {

/// The displacements of one frame. Borrowed.
struct Displacements {
  const double* displacement_px = nullptr;  ///< 2M, padded; 0 where missing
  std::span<const int> missing;             ///< coordinates without a displacement
  double squares_px2 = 0.0;                 ///< sum of the squared displacements
  double noise_px = 0.0;                    ///< n
};

/// Thread-bound. Allocates only when made.
class Posterior {
 public:
  /// Both must outlive it. `most`: atoms that fit() takes.
  Posterior(const Factors& factors, const Atoms& atoms, int most);

  /// `chosen` must live until the next fit(). False: the equations could not be solved.
  bool fit(const Displacements& picture, const Chosen& chosen);

  // What fit() found, of the chosen atoms in their order.
  std::span<const double> forces_N() const { return {forces_.data(), 3 * chosen_->atoms.size()}; }
  std::span<const double> known() const { return {known_.data(), chosen_->atoms.size()}; }
  double squaredResidual_px2() const { return squaredResidual_; }
  const std::array<double, kMotions>& motion() const { return motion_; }  ///< in its prior's deviations

  /// Noise of the chosen atoms; takes as long as fit().
  void noise_N2(std::span<double> noise);

  /// Covariance of the wrench about the origin, row after row [N^2, N^2 m, N^2 m^2].
  void wrenchCovariance(std::array<double, 36>& covariance);

  /// Standard deviations of the forces of all nodes (3N), each the sum of the points that are published there; takes as
  /// long as fit(). What no chosen atom covers has none.
  void nodeDeviations_N(std::span<double> deviations);

  /// Computes the covariance of `count` functionals of the points' forces, row after row. `weights`: 3P x count, row
  /// after row; at most kColumns functionals.
  void covariance(std::span<const double> weights, int count, std::span<double> covariance);

  /// Force and moment about the origin [N, N m].
  std::array<double, 6> wrench() const;

 private:
  int unknowns() const { return 3 * static_cast<int>(chosen_->atoms.size()) + kMotions; }
  double* row(int unknown) { return matrix_.data() + static_cast<std::ptrdiff_t>(unknown) * (unknown + 1) / 2; }
  void assemble();
  void takeOut(std::span<const int> missing);
  void invert(int panel, int other);
  void invertRest();
  void multiplyInverse(int count, double* covariance);
  Block inverseOf(int atom) const;

  const Factors& factors_;
  const Atoms& atoms_;
  Eigen::SparseMatrix<double, Eigen::RowMajor> atomsOfNodes_;  // N x A, share of an atom's force that a node has
  Eigen::Matrix<double, 6, Eigen::Dynamic> wrench_;            // of unit forces of all atoms, 6 x 3A
  const int stride_;                                           // of inverse_: the most unknowns, padded
  // Of one fit.
  const Chosen* chosen_ = nullptr;
  double noise_px_ = 0.0, squaredResidual_ = 0.0;
  std::vector<Block> roots_;            // S of each atom
  std::vector<int> rows_;               // of the influence matrix
  std::vector<double> matrix_;          // A, then its factor, packed
  std::vector<double> right_, x_;       // B'd, x
  std::vector<double> missingRows_;     // B' of some missing coordinates
  LineArray<double> scratch_, panels_;  // panels of kColumns columns of the factor's inverse
  std::vector<double> inverse_;         // A^-1, as far as it was computed
  std::vector<double> forces_, known_;
  std::vector<int> indexOf_;   // A: of each atom among the chosen, or -1
  std::vector<int> covering_;  // unknowns of the atoms that cover a node
  std::vector<double> share_;  // of each of these in a force of the node
  std::array<double, kMotions> motion_{};
};

}  // namespace tractiond::solve
