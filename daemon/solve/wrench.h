// Force and moment about the origin of the gel frame, in this order [N, N m].
#pragma once

#include "daemon/records/traction_field.h"

#include <Eigen/Core>

#include <algorithm>
#include <array>

namespace tractiond::solve {

/// Returns the wrenches of unit forces at a point [m] along the three axes, 6 x 3 [N, N m per N].
inline Eigen::Matrix<double, 6, 3> unitWrenches(const Eigen::Vector3d& at) {
  Eigen::Matrix<double, 6, 3> wrenches;
  wrenches << Eigen::Matrix3d::Identity(), 0.0, -at.z(), at.y(), at.z(), 0.0, -at.x(), -at.y(), at.x(), 0.0;
  return wrenches;
}

/// Returns resultant and moment of a field [N, N m].
inline std::array<double, 6> wrenchOf(const TractionField& field) {
  std::array<double, 6> wrench{};
  std::copy_n(field.resultant_N.begin(), 3, wrench.begin());
  std::copy_n(field.moment_Nm.begin(), 3, wrench.begin() + 3);
  return wrench;
}

}  // namespace tractiond::solve
