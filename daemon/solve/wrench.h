// Force and moment about the origin of the gel frame, in this order [N, N m].
#pragma once

#include "daemon/records/traction_field.h"

#include <Eigen/Core>

#include <algorithm>
#include <array>

namespace tractiond::solve {

using Wrench = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;

/// Returns the wrenches of unit forces at a point [m] along the three axes, 6 x 3 [N, N m per N].
inline Eigen::Matrix<double, 6, 3> unitWrenches(const Eigen::Vector3d& at) {
  Eigen::Matrix<double, 6, 3> wrenches;
  wrenches << Eigen::Matrix3d::Identity(), 0.0, -at.z(), at.y(), at.z(), 0.0, -at.x(), -at.y(), at.x(), 0.0;
  return wrenches;
}

/// Writes the wrenches of forces at a point [m] along the three axes: six numbers of the row of each.
/// \param factor the forces [N]
inline void writeWrenches(const Eigen::Vector3d& at, double factor, double* rows, std::ptrdiff_t stride) {
  using Rows = Eigen::Map<Eigen::Matrix<double, 3, 6, Eigen::RowMajor>, 0, Eigen::OuterStride<>>;
  Rows(rows, 3, 6, Eigen::OuterStride<>(stride)) = factor * unitWrenches(at).transpose();
}

/// Returns the matrix that converts a wrench about the origin into the wrench about a point [m]; that of the point with
/// the other sign is its inverse.
inline Eigen::Matrix<double, 6, 6> toPoint(const Eigen::Vector3d& at) {
  Eigen::Matrix<double, 6, 6> matrix = Eigen::Matrix<double, 6, 6>::Identity();
  matrix.leftCols<3>() = unitWrenches(-at);
  return matrix;
}

/// Returns the covariance of a wrench about a point [m] from that about the origin.
inline WrenchCovariance covarianceAt(const Eigen::Vector3d& at, const WrenchCovariance& aboutOrigin) {
  WrenchCovariance result;
  const Eigen::Matrix<double, 6, 6> move = toPoint(at);
  Matrix6::Map(result.data()) = move * Matrix6::Map(aboutOrigin.data()) * move.transpose();
  return result;
}

/// Returns force and moment of a contact about its point [N, N m].
inline Wrench wrenchOf(const Contact& contact) {
  Wrench wrench;
  wrench << Eigen::Vector3d::Map(contact.force_N.data()), Eigen::Vector3d::Map(contact.moment_Nm.data());
  return wrench;
}

/// Returns resultant and moment of a field [N, N m].
inline Wrench wrenchOf(const TractionField& field) {
  Wrench wrench;
  wrench << Eigen::Vector3d::Map(field.resultant_N.data()), Eigen::Vector3d::Map(field.moment_Nm.data());
  return wrench;
}

}  // namespace tractiond::solve
