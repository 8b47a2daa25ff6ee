// The mean of several posteriors by their evidence, and its covariance: that within them and that between them.
#pragma once

#include "daemon/solve/posterior.h"

#include <array>

namespace tractiond::solve {

/// Thread-bound. Allocates only when made.
class Mixture {
 public:
  /// For `most` posteriors. `atoms` must outlive it.
  Mixture(const Atoms& atoms, int most);

  /// Forgets all posteriors: everything is 0.
  void clear();

  /// Adds a posterior, which must last, and returns its forces of the points (3P), to be filled. `worth`: log evidence.
  std::span<double> add(Posterior& posterior, double worth, const std::array<double, 6>& wrench);

  /// Computes the shares and the mean forces. To be called when all are there.
  void weigh();

  int count() const { return count_; }
  double share(int i) const { return parts_[static_cast<std::size_t>(i)].share; }
  std::span<const double> pointForces_N() const { return mean_; }
  std::array<double, 6> wrench() const;
  std::array<double, kMotions> motion() const;
  double squaredResidual_px2() const;
  void wrenchCovariance(std::array<double, 36>& covariance);

  /// Standard deviations of the forces of all nodes (3N), as Posterior::nodeDeviations_N().
  void nodeDeviations_N(std::span<double> deviations);

  /// Covariance of `count` functionals of the points' forces, as Posterior::covariance().
  void covariance(std::span<const double> weights, int count, std::span<double> covariance);

 private:
  struct Part {
    Posterior* posterior = nullptr;
    double worth = 0.0, share = 0.0;
    std::array<double, 6> wrench{};
    std::vector<double> force_N;  // 3P
  };

  template <typename Use>
  void eachThatCounts(Use use);

  std::span<const Part> parts() const { return {parts_.data(), static_cast<std::size_t>(count_)}; }

  const Atoms& atoms_;
  std::vector<Part> parts_;
  int count_ = 0;
  std::vector<double> mean_, away_;           // 3P: mean force, how a part's differs
  std::vector<double> deviation_, nodeAway_;  // 3N: of a part
};

}  // namespace tractiond::solve
