#include "daemon/solve/motion_weight.h"

#include <Eigen/Eigenvalues>

namespace tractiond::solve {

MotionWeight::MotionWeight(const MotionPrior& motion, double noise_px)
    : axes_(motion.modes * (motion.variances.cwiseSqrt() / noise_px).asDiagonal()) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> moved(axes_.transpose() * axes_);
  squares_ = moved.eigenvalues().cwiseMax(0.0);
  const Eigen::Vector4d reciprocal = (squares_.array() > 0.0).select(squares_.array().max(1e-300).rsqrt(), 0.0);
  axes_ = axes_ * (moved.eigenvectors() * reciprocal.asDiagonal());
}

void MotionWeight::apply(Eigen::MatrixXd& matrix) const {
  const Eigen::Vector4d share = 1.0 - (1.0 + squares_.array()).rsqrt();
  matrix -= axes_ * share.asDiagonal() * (axes_.transpose() * matrix);
}

}  // namespace tractiond::solve
