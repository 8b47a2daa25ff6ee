// Computes the weight of displacements where the whole picture may move: W = (1 + P Q P' / n^2)^-1.
#pragma once

#include <Eigen/Core>

namespace tractiond::solve {

/// Number of motions: shift of the picture along u and v, its scale and its roll.
inline constexpr int kMotions = 4;

struct MotionPrior {
  Eigen::MatrixXd modes;      ///< P, 2M x 4: displacements by a unit of each motion [px/px, px/px, px, px/rad]
  Eigen::Vector4d variances;  ///< diagonal of Q [px^2, px^2, 1, rad^2]; 0: that motion does not happen
};

/// Immutable once made; any thread may read it.
class MotionWeight {
 public:
  /// `motion` need not outlive it. \param noise_px n, the standard deviation of a coordinate; above 0
  MotionWeight(const MotionPrior& motion, double noise_px);

  /// Multiplies W^1/2 by a matrix of 2M rows, in place.
  void apply(Eigen::MatrixXd& matrix) const;

  /// Returns R, 2M x 4: the left singular vectors of P Q^1/2 / n. A motion that does not happen makes a zero column.
  const Eigen::MatrixXd& axes() const { return axes_; }
  /// Returns the diagonal of D in W = 1 - R D R', each element in [0, 1); 0 for a motion that does not happen.
  Eigen::Vector4d gain() const { return squares_.array() / (1.0 + squares_.array()); }

 private:
  Eigen::MatrixXd axes_;
  Eigen::Vector4d squares_;  // of the singular values
};

}  // namespace tractiond::solve
