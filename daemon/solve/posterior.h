// Computes the posterior of the chosen atoms from a picture and their prior.
//
//   B = [H, E, P Q^1/2],  A = B'B + n^2 C^-1    over the coordinates that are there; C: gamma Omega, elsewhere 1
//   x = A^-1 B'd         the atoms' forces f, then extra unknowns, the motion's own 4 last
//   Sigma = n^2 A^-1                            covariance of x
//   known_a = 3 - tr Sigma_aa / gamma_a         degrees of freedom
//   noise_a = n^2 tr [A^-1 - n^2 A^-1 C^-1 A^-1]_aa    variance of f by the picture's noise
//   log evidence = -1/2 (|d - B x|^2 / n^2 + x' C^-1 x + log det(A C / n^2))    without terms that no prior changes
#pragma once

#include "daemon/solve/candidate.h"
#include "daemon/solve/extra_unknowns.h"
#include "daemon/solve/prior.h"

#include <array>
#include <span>
#include <vector>

namespace tractiond::solve {

/// Correction of the log evidence of a prior that was fitted to the picture, for each degree of freedom.
inline constexpr double kOptimism = 1.0;

/// Thread-bound. Allocates only when made.
class Posterior final : public Candidate {
 public:
  /// `factors` and `atoms` must outlive it.
  /// \param most atoms that fit() takes
  /// \param mostExtra extra unknowns
  Posterior(const Factors& factors, const Atoms& atoms, int most, int mostExtra = 0);

  /// Computes the posterior. Returns false if the equations could not be solved, or a covariance of `chosen` is not
  /// positive definite; the results then have no meaning. The displacements must be finite, which is not checked.
  /// `chosen` and `extra` must live until the next fit().
  /// \param products of a picture with the same missing coordinates; without `extra`, of this picture. Missing products
  /// of chosen atoms are added
  /// \param extra after ExtraUnknowns::multiply() with this picture; null: none
  bool fit(const Displacements& picture, AtomProducts& products, const Chosen& chosen, ExtraUnknowns* extra = nullptr);

  // Results of the last fit().

  /// Computes the forces of all atoms (3A [N]): 0 for those that were not chosen.
  void allForces_N(std::span<double> forces) const;
  /// Returns known_a of the chosen atoms, in their order. Valid until the next known(), keep() or fit().
  std::span<const double> known();
  /// Returns the values of the extra unknowns.
  std::span<const double> extra() const { return {x_.data() + 3 * chosen_->atoms.size(), extraCount()}; }
  double logEvidence() const { return logEvidence_; }  ///< Returns the log evidence, as above.

  /// Computes noise_a of the chosen atoms, in their order [N^2]; takes as long as fit().
  /// \param noise at least as many elements; the rest stays unchanged
  void noise_N2(std::span<double> noise);

  /// Copies the results of the chosen atoms, and `noise` (noise_N2()), into the moments of all atoms; those of other
  /// atoms remain unchanged. Returns the degrees of freedom, the sum of known_a.
  double keep(std::span<const double> noise, AtomMoments& moments);

  /// Computes the covariance of the extra unknowns, row after row; its unit is 1, as that of their prior.
  void extraCovariance(std::span<double> covariance);

  /// Returns force and moment of atoms and extra unknowns about the origin of the gel frame [N, N m].
  Wrench wrench() const;

  // These implement Candidate; the wrench is wrench(). nodeDeviations_N() takes as long as fit().
  const std::array<double, kMotions>& motion() const override { return motion_; }
  double squaredResidual_px2() const override { return squaredResidual_; }
  void wrenchCovariance(std::array<double, 36>& covariance) override;
  void nodeDeviations_N(std::span<double> deviations) override;
  void covariance(std::span<const double> weights, std::span<const int> points, std::span<double> covariance) override;

  // What the last fit() was given.

  const Chosen& chosen() const { return *chosen_; }        ///< Returns the chosen atoms and their priors.
  ExtraUnknowns* extraUnknowns() const { return extra_; }  ///< Returns the extra unknowns; null: none.
  double noise_px() const { return noise_px_; }            ///< Returns n.

 private:
  std::size_t extraCount() const { return extra_ == nullptr ? 0 : static_cast<std::size_t>(extra_->count()); }
  int firstExtra() const { return 3 * static_cast<int>(chosen_->atoms.size()); }
  int firstMotion() const { return firstExtra() + static_cast<int>(extraCount()); }
  int unknowns() const { return firstMotion() + kMotions; }
  /// Returns the number of elements of a packed lower triangle.
  static std::size_t packed(int size) { return size * (static_cast<std::size_t>(size) + 1) / 2; }
  double* row(int unknown) { return matrix_.data() + static_cast<std::ptrdiff_t>(unknown) * (unknown + 1) / 2; }
  bool invertPriors();
  void multiplyDisplacement(const Displacements& picture, const AtomProducts& products);
  void assemble(const AtomProducts& products);
  void assembleExtra();
  void invertDiagonal();
  void invertColumns(int panel);
  void invert(int panel, int other);
  void invertAll();
  double traceOf(int atom) const;
  // posterior_covariance.cpp
  void invertTogether();
  std::size_t cover(Eigen::Index node, int axis);
  void multiplyInverse(int count, double* covariance);

  const Factors& factors_;
  const Atoms& atoms_;
  const int stride_;  // of inverse_: the most unknowns, padded
  // Of one fit.
  const Chosen* chosen_ = nullptr;
  ExtraUnknowns* extra_ = nullptr;
  double noise_px_ = 0.0, squaredResidual_ = 0.0, logEvidence_ = 0.0;
  bool diagonalInverted_ = false;       // the panels of A^-1 on its diagonal are computed
  std::vector<Block> tightness_;        // C^-1 of each atom
  std::vector<int> index_;              // of each atom in the products
  double logPrior_ = 0.0;               // log det C
  std::vector<double> right_, x_;       // B'd, x
  LineArray<double> matrix_;            // A, then its factor, packed
  LineArray<double> scratch_, panels_;  // panels of kColumns columns of the factor's inverse
  LineArray<double> inverse_;           // A^-1, as far as it was computed
  std::vector<double> known_;
  std::vector<int> indexOf_;             // A: of each atom among the chosen, or -1
  std::vector<int> covering_;            // unknowns that act at a node, rising
  std::size_t coveringAtoms_ = 0;        // of these, those of atoms; they come first
  std::vector<double> share_;            // of each of these in a force of the node
  std::vector<unsigned char> together_;  // of two panels, whether some of their unknowns act at the same node
  std::array<double, kMotions> motion_{};
};

/// A posterior with what it was solved for.
struct ChosenPosterior {
  /// Parameters as of Posterior().
  ChosenPosterior(const Factors& factors, const Atoms& atoms, int most, int mostExtra)
      : posterior(factors, atoms, most, mostExtra) {
    chosen.reserve(most);
  }
  Chosen chosen;
  Posterior posterior;
};

}  // namespace tractiond::solve
