// Interface of what a Mixture weighs: forces that may have caused a picture, with their covariance.
#pragma once

#include "daemon/solve/atoms.h"

#include <algorithm>
#include <array>
#include <span>

namespace tractiond::solve {

/// Thread-bound.
class Candidate {
 public:
  /// Returns the motion of the picture, in deviations of its prior.
  virtual const std::array<double, kMotions>& motion() const = 0;
  /// Returns the squares of what the forces leave of the displacements [px^2]; rounding may make it < 0.
  virtual double squaredResidual_px2() const = 0;

  /// Computes the covariance of force and moment about the origin, row after row [N^2, N^2 m, N^2 m^2].
  virtual void wrenchCovariance(std::array<double, 36>& covariance) = 0;

  /// Computes the standard deviations of the forces of all nodes (3N [N]); each force is the sum of the points that are
  /// published there. A node on which no unknown acts has the deviation 0.
  virtual void nodeDeviations_N(std::span<double> deviations) = 0;

  /// Computes the covariance of kColumns linear functionals of the points' forces and the couples, row after row.
  /// \param weights 3 (P + kCouples) x kColumns, row after row \param points that have weights other than 0; only
  /// theirs are read
  virtual void covariance(std::span<const double> weights, std::span<const int> points,
                          std::span<double> covariance) = 0;

  /// Computes lower bounds of the diagonal of covariance(), of the same functionals, in a small part of its time; 0,
  /// where it cannot be done.
  virtual void leastVariances(std::span<const double> /*weights*/, std::span<const int> /*points*/,
                              std::span<double> variances) {
    std::fill(variances.begin(), variances.end(), 0.0);
  }

 protected:
  ~Candidate() = default;
};

}  // namespace tractiond::solve
