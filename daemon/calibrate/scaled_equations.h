// Normal equations of a fit whose unknowns differ by many decades.
#pragma once

#include <Eigen/Cholesky>

namespace tractiond::calibrate {

/// Solves symmetric equations, each unknown in units in which the diagonal is 1. Immutable after construction.
class ScaledEquations {
 public:
  ScaledEquations() = default;
  explicit ScaledEquations(const Eigen::MatrixXd& matrix)
      : unit_(matrix.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse())
      , factor_(unit_.asDiagonal() * matrix * unit_.asDiagonal()) {}

  Eigen::VectorXd solve(const Eigen::VectorXd& right) const {
    return unit_.cwiseProduct(factor_.solve(unit_.cwiseProduct(right)));
  }
  Eigen::MatrixXd inverse() const {
    return unit_.asDiagonal() * factor_.solve(Eigen::MatrixXd::Identity(unit_.size(), unit_.size())) *
           unit_.asDiagonal();
  }
  /// Returns an element of the inverse's diagonal.
  double variance(Eigen::Index unknown) const {
    const Eigen::VectorXd one = Eigen::VectorXd::Unit(unit_.size(), unknown);
    return unit_[unknown] * unit_[unknown] * factor_.solve(one)[unknown];
  }

 private:
  Eigen::VectorXd unit_;
  Eigen::LDLT<Eigen::MatrixXd> factor_;
};

}  // namespace tractiond::calibrate
