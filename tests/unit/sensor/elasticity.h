// Slow, obvious checks of a displacement field: Navier's equation and Hooke's law by central differences.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <functional>

namespace sensor::elastic {

/// Displacement at a point [m/N]; column j under the unit force along axis j.
using Field = std::function<Eigen::Matrix3d(const Eigen::Vector3d&)>;

/// Largest |kappa lap(u) + grad(div u)| over the three forces, in parts of the largest term. Laplacian by differences
/// at distance `step`; `gradientOfDivergence`: column j under the unit force along axis j.
inline double navierResidual(const Field& field, const Eigen::Vector3d& x, double step, double poissonRatio,
                             const Eigen::Matrix3d& gradientOfDivergence) {
  const double kappa = 1.0 - 2.0 * poissonRatio;
  Eigen::Matrix3d laplacian = Eigen::Matrix3d::Zero();
  double size = gradientOfDivergence.colwise().norm().maxCoeff();
  for (int a = 0; a < 3; ++a) {
    const Eigen::Vector3d d = step * Eigen::Vector3d::Unit(a);
    const Eigen::Matrix3d second =
        (16.0 * (field(x + d) + field(x - d)) - (field(x + 2 * d) + field(x - 2 * d)) - 30.0 * field(x)) /
        (12.0 * step * step);
    laplacian += second;
    size = std::max(size, kappa * second.colwise().norm().maxCoeff());
  }
  return (kappa * laplacian + gradientOfDivergence).colwise().norm().maxCoeff() / size;
}

/// Gradients [axis](component, force) by fourth-order differences.
inline std::array<Eigen::Matrix3d, 3> gradient(const Field& field, const Eigen::Vector3d& x, double step) {
  std::array<Eigen::Matrix3d, 3> result;
  for (int a = 0; a < 3; ++a) {
    const Eigen::Vector3d d = step * Eigen::Vector3d::Unit(a);
    result[a] = (8.0 * (field(x + d) - field(x - d)) - (field(x + 2 * d) - field(x - 2 * d))) / (12.0 * step);
  }
  return result;
}

/// One for each force.
inline Eigen::RowVector3d divergence(const Field& field, const Eigen::Vector3d& x, double step) {
  const auto g = gradient(field, x, step);
  return g[0].row(0) + g[1].row(1) + g[2].row(2);
}

/// Stress tensors under the three unit forces by Hooke's law.
inline std::array<Eigen::Matrix3d, 3> stressByDifferences(const Field& field, const Eigen::Vector3d& x, double step,
                                                          double youngsModulus, double poissonRatio) {
  using Eigen::Matrix3d;
  const std::array<Matrix3d, 3> slopes = gradient(field, x, step);
  const double shear = youngsModulus / (2.0 * (1.0 + poissonRatio));
  const double lame = 2.0 * shear * poissonRatio / (1.0 - 2.0 * poissonRatio);
  std::array<Matrix3d, 3> stress;
  for (int force = 0; force < 3; ++force) {
    Matrix3d slope;
    for (int a = 0; a < 3; ++a) slope.col(a) = slopes[a].col(force);
    stress[force] = shear * (slope + slope.transpose()) + lame * slope.trace() * Matrix3d::Identity();
  }
  return stress;
}

}  // namespace sensor::elastic
