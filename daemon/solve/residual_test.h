// Tests whether a picture shows a force that a linear posterior does not hold: the most significant force of any atom
// in what it leaves of the strongest modes.
//
//   r = c - M xi             c: the picture's amplitudes, M: those of xi
//   b_a = (S V_a)' r / n     matched to an atom; if the posterior holds, its covariance is
//   K_a = (S V_a)' (1 - M (Lambda + 1)^-1 M' / n^2) (S V_a),   and b' K^-1 b is chi^2 of 3 degrees
//
// What xi and the curves add to b_a is computed once; what the picture does, detection has computed.
#pragma once

#include "daemon/solve/linear_posterior.h"
#include "daemon/solve/strong_modes.h"

#include <memory>
#include <span>
#include <vector>

namespace tractiond::solve {

/// Thread-bound, as LinearPosterior.
class ResidualTest {
 public:
  /// \param mostUnknowns of a posterior
  /// \param mostCurves of a posterior
  ResidualTest(std::shared_ptr<const StrongModes> modes, int mostUnknowns, int mostCurves);

  /// Prepares the test of a posterior.
  /// \param extra its extra unknowns, as it was made of; null: none
  /// \param curves that it was made with
  void make(const LinearPosterior& posterior, const ExtraUnknowns* extra, const RowMatrix& curves);

  /// Starts on a picture of which all is known that it shows of each atom.
  /// \param matched n b_a without the posterior, 3A [px^2/N]
  void begin(std::span<const double> matched);
  /// Starts on a picture (2M).
  void begin(std::span<const float> displacement_px);
  /// Adds displacements to the picture.
  /// \param displacement_px of these coordinates
  void add(std::span<const int> coordinates, std::span<const float> displacement_px);
  /// Returns the deviations of the most significant force that is left by the posterior's last answer at s = 1, 0 or
  /// more. The picture must have what the posterior makes of it where it is missing.
  /// \param times as given to the posterior
  double significance(const LinearPosterior& posterior, std::span<const double> times, double noise_px);

 private:
  void layUnknowns(const LinearPosterior& posterior, const ExtraUnknowns* extra, const RowMatrix& curves);
  Eigen::MatrixXd seenBy(const LinearPosterior& posterior, int curves);
  void explain(const Eigen::MatrixXd& seen, int rank);

  const std::shared_ptr<const StrongModes> strong_;
  const int modes_;
  std::vector<int> everyCoordinate_, everyMode_, everyComponent_;
  std::vector<Block> precision_;  // A: K_a^-1
  Eigen::MatrixXd root_;          // of Lambda + 1, with what is missing
  RowMatrix explained_;           // (S V_a)' [M root_'^-1 / n, curves], 3A x (rank + curves)
  RowMatrix modesOfUnknowns_;     // modes x (unknowns, curves), scratch of make()
  LineArray<double> columns_, sum_;
  LineArray<float> left_, found_;
  std::vector<double> products_, matched_, added_;
  std::vector<float> coefficients_;
};

}  // namespace tractiond::solve
