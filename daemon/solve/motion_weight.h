// The weight of displacements where the whole picture may move: W = (1 + P Q P' / n^2)^-1.
#pragma once

#include <Eigen/Core>

namespace tractiond::solve {

/// Shift of the picture along u and v, its scale and its roll.
inline constexpr int kMotions = 4;

/// P and the diagonal of Q.
struct MotionPrior {
  Eigen::MatrixXd modes;      ///< 2M x 4
  Eigen::Vector4d variances;  ///< 0: that motion does not happen
};

/// Immutable once made; any thread may read it.
class MotionWeight {
 public:
  /// \param noise_px n, the standard deviation of a coordinate
  MotionWeight(const MotionPrior& motion, double noise_px);

  /// matrix = W^1/2 matrix, of 2M rows.
  void apply(Eigen::MatrixXd& matrix) const;

  /// R, 2M x 4: the left singular vectors of P Q^1/2 / n; a motion that does not happen has a zero column.
  const Eigen::MatrixXd& axes() const { return axes_; }
  /// D: W = 1 - R D R'.
  Eigen::Vector4d gain() const { return squares_.array() / (1.0 + squares_.array()); }

 private:
  Eigen::MatrixXd axes_;
  Eigen::Vector4d squares_;  // of the singular values
};

}  // namespace tractiond::solve
