// Interface of what a Mixture weighs: forces that may have caused a picture, with their covariance.
#pragma once

#include "daemon/solve/atoms.h"

#include <algorithm>
#include <array>
#include <span>

namespace tractiond::solve {

/// The results are those of the last picture that was solved. Thread-bound. P and N are the numbers of points and
/// nodes (atoms.h).
class Candidate {
 public:
  /// Returns shift along u and v, scale and roll of the whole picture [deviations of their priors].
  virtual const std::array<double, kMotions>& motion() const = 0;
  /// Returns the sum over all coordinates of the squared differences between the displacements and those that forces
  /// and motion cause [px^2]. Missing coordinates are left out. Rounding may make it < 0.
  virtual double squaredResidual_px2() const = 0;

  /// Computes the covariance of force and moment about the origin, row after row [N^2, N^2 m, N^2 m^2].
  virtual void wrenchCovariance(std::array<double, 36>& covariance) = 0;

  /// Computes the standard deviations of the forces of all nodes (3N [N]); each force is the sum of the points that are
  /// published there. A node on which no unknown acts has the deviation 0.
  virtual void nodeDeviations_N(std::span<double> deviations) = 0;

  /// Computes the covariance of kColumns weighted sums W' f, where f are the forces of the points [N] and the couples
  /// [N m]. For example, with weights of 1 or 0 a sum is the force on some of the points.
  /// \param weights W, 3 (P + kCouples) x kColumns, row after row
  /// \param points indices of the points and couples that have weights other than 0; only their weights are read
  /// \param covariance kColumns x kColumns, row after row
  virtual void covariance(std::span<const double> weights, std::span<const int> points,
                          std::span<double> covariance) = 0;

  /// Computes lower bounds of the diagonal of covariance(), with the same arguments, in a small part of its time. A
  /// caller that finds a value insignificant even with them need not call covariance(). Computes 0 if not overridden.
  /// \param variances kColumns elements
  virtual void leastVariances(std::span<const double> /*weights*/, std::span<const int> /*points*/,
                              std::span<double> variances) {
    std::fill(variances.begin(), variances.end(), 0.0);
  }

 protected:
  ~Candidate() = default;
};

}  // namespace tractiond::solve
