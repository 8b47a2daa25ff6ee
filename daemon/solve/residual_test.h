// Tests whether a picture shows a force that a linear posterior does not hold: the surest force of any atom in what it
// leaves of the strongest modes.
//
//   r = c - M xi             c: the picture's amplitudes, M: those of xi
//   b_a = (S V_a)' r / n     matched to an atom; if the posterior holds, its covariance is
//   K_a = (S V_a)' (1 - M (Lambda + 1)^-1 M' / n^2) (S V_a),   and b' K^-1 b is chi^2 of 3 degrees
#pragma once

#include "daemon/solve/linear_posterior.h"

#include <memory>
#include <span>
#include <vector>

namespace tractiond::solve {

/// What the strongest modes show of each atom. Immutable once made; any thread may read it.
struct AtomModes {
  /// The arguments need not outlive it. \param count number of the strongest modes that are looked at
  AtomModes(const Factors& factors, const Atoms& atoms, int count);

  int count;                 ///< of the modes
  RowMatrix rows;            ///< (S V_a)', 3A x count [px/N]
  std::vector<Block> alone;  ///< A: (S V_a)' S V_a
};

/// Thread-bound, as LinearPosterior.
class ResidualTest {
 public:
  /// `factors` must outlive it. \param mostUnknowns of a posterior
  ResidualTest(const Factors& factors, std::shared_ptr<const AtomModes> modes, int mostUnknowns);

  /// Prepares the test of a posterior. \param extra its extra unknowns, as it was made of; null: none
  void make(const LinearPosterior& posterior, const ExtraUnknowns* extra);

  /// Returns the deviations of the surest force that is left by the posterior's last answer at s = 1, 0 or more. \param
  /// displacement_px of the picture (2M), with what the posterior makes of them where they are missing
  double surest(const LinearPosterior& posterior, std::span<const float> displacement_px, double noise_px);

 private:
  const Factors& factors_;
  const std::shared_ptr<const AtomModes> atomModes_;
  const int modes_;
  std::vector<int> everyCoordinate_, everyMode_, everyComponent_;
  RowMatrix seen_;                // M' / n, rank x modes
  std::vector<Block> precision_;  // A: K_a^-1
  RowMatrix modesOfUnknowns_;     // modes x unknowns, scratch of make()
  LineArray<double> columns_, sum_;
  std::vector<double> products_, matched_;
  LineArray<float> left_;
  std::vector<float> coefficients_;
};

}  // namespace tractiond::solve
