// Averages several candidates, weighted by their evidence. The covariance of the mean has two parts: that within the
// candidates, and that between them.
#pragma once

#include "daemon/solve/atoms.h"
#include "daemon/solve/candidate.h"
#include "daemon/solve/wrench.h"

#include <array>
#include <vector>

namespace tractiond::solve {

/// Thread-bound. Allocates only when made.
class Mixture {
 public:
  /// What a candidate explains a picture by.
  enum class Kind {
    kField,    ///< the field of atoms alone
    kEven,     ///< an even contact
    kPatched,  ///< round patches and the field around them
  };

  /// Makes room for `most` candidates. `atoms` must outlive it.
  /// \param most largest number of calls of add() between two of clear()
  Mixture(const Atoms& atoms, int most);

  /// Removes all candidates; all results are 0 until the next add().
  void clear();

  /// Adds a candidate, which must live, with its results, until the next clear(). Returns an array for the forces of
  /// its points [N] and its couples [N m], 3 (P + kCouples), which the caller must fill before weigh(). Must not be
  /// called more than `most` times (asserted).
  /// \param worth log evidence
  /// \param wrench force and moment of the candidate about the origin [N, N m]
  std::span<double> add(Candidate& candidate, Kind kind, double worth, const Wrench& wrench);

  /// Returns the largest `worth` of all candidates; there must be one.
  double mostWorth() const;

  /// Computes share(), in proportion to exp(worth) and with the sum 1, and pointForces_N(). Must be called after the
  /// last add(), of which there must be one, and before the functions below.
  void weigh();

  int count() const { return count_; }  ///< Returns the number of candidates.
  /// Returns the share of the i-th candidate, 0 to 1.
  double share(int i) const { return parts_[i].share; }
  /// Returns the kind of the i-th candidate.
  Kind kind(int i) const { return parts_[i].kind; }
  double shareOf(Kind kind) const;  ///< Returns the sum of the shares of a kind.
  /// Returns the wrench of the i-th candidate [N, N m].
  const Wrench& wrench(int i) const { return parts_[i].wrench; }
  /// Returns the mean forces of the points, 3P; set by weigh() and clear().
  std::span<const double> pointForces_N() const { return std::span(mean_).first(mean_.size() - 3 * kCouples); }
  /// Returns the mean couples, 3 kCouples; set by weigh() and clear().
  std::span<const double> couples_Nm() const { return std::span(mean_).last(3 * kCouples); }
  Wrench wrench() const;                        ///< Returns the mean force and moment about the origin [N, N m].
  std::array<double, kMotions> motion() const;  ///< Returns the mean motion, in deviations of its prior.
  double squaredResidual_px2() const;           ///< Returns the mean of the squared residuals [px^2].
  /// Computes the covariance of wrench(), row after row [N^2, N^2 m, N^2 m^2].
  void wrenchCovariance(std::array<double, 36>& covariance);

  /// Computes the standard deviations of the forces of all nodes (3N), as Candidate::nodeDeviations_N().
  void nodeDeviations_N(std::span<double> deviations);

  /// Computes the covariance of kColumns weighted sums of the mean forces and couples: that within the candidates, and
  /// that between them. The arguments are those of Candidate::covariance().
  void covariance(std::span<const double> weights, std::span<const int> points, std::span<double> covariance);
  /// Computes lower bounds of the diagonal of covariance(), kColumns elements, by the likeliest candidate alone. The
  /// arguments are those of Candidate::leastVariances().
  void leastVariances(std::span<const double> weights, std::span<const int> points, std::span<double> variances);

 private:
  struct Part {
    Candidate* candidate = nullptr;
    Kind kind = Kind::kField;
    double worth = 0.0, share = 0.0;
    Wrench wrench = Wrench::Zero();
    std::vector<double> force_N;  // 3 (P + kCouples)
  };

  template <typename Use>
  void eachThatCounts(Use use);

  std::span<const Part> parts() const { return {parts_.data(), static_cast<std::size_t>(count_)}; }

  const Atoms& atoms_;
  std::vector<Part> parts_;
  int count_ = 0;
  std::vector<double> mean_, away_;           // 3 (P + kCouples): mean; difference of a part from it
  std::vector<double> deviation_, nodeAway_;  // 3N: of a part
};

}  // namespace tractiond::solve
