// The part of a force's uncertainty that is the same in every frame.
#pragma once

#include "daemon/records/traction_field.h"
#include "daemon/solve/inverse.h"

namespace tractiond::solve {

/// Elements of Inverse::poseErrors.
inline constexpr int kPoseErrors = 7 * 36;

/// Inverse::poseErrors: unit forces at nine nodes, seen by a camera that stands a deviation elsewhere, solved by
/// `inverse`. `displacement` is 3M x 3N [m/N].
std::vector<double> poseErrors(const sensor::Sensor& sensor, const Eigen::MatrixXd& displacement,
                               const Inverse& inverse);

/// Covariance of the wrench (Fx .. Mz) by Young's modulus, mechanics and pose.
WrenchCovariance systematicCovariance(const std::array<double, 6>& wrench, const sensor::Uncertainty& uncertainty,
                                      double pitch_m, const std::vector<double>& poseErrors);

}  // namespace tractiond::solve
