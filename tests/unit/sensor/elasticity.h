// Slow, obvious checks of a displacement field: Navier's equation and Hooke's law by central differences.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <functional>

namespace sensor::elastic {

/// Displacement at a point [m/N]; column j under the unit force along axis j.
using Field = std::function<Eigen::Matrix3d(const Eigen::Vector3d&)>;

/// Largest |kappa lap(u) + grad(div u)| over the three forces, in parts of the sum of the terms' own sizes (second
/// derivatives at distance `step`, fourth order).
inline double navierResidual(const Field& field, const Eigen::Vector3d& x, double step, double poissonRatio) {
  using Eigen::Matrix3d, Eigen::Vector3d;
  constexpr std::array kFirst = {1.0 / 12, -8.0 / 12, 0.0, 8.0 / 12, -1.0 / 12};
  constexpr std::array kSecond = {-1.0 / 12, 16.0 / 12, -30.0 / 12, 16.0 / 12, -1.0 / 12};
  const auto shifted = [&](int a, int i, int b, int k) -> Matrix3d {
    return field(x + step * (i * Vector3d::Unit(a) + k * Vector3d::Unit(b)));
  };
  std::array<std::array<Matrix3d, 3>, 3> second;
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b <= a; ++b) {
      Matrix3d sum = Matrix3d::Zero();
      for (int i = -2; i <= 2; ++i) {
        if (a == b) sum += kSecond[i + 2] * shifted(a, i, a, 0);
        for (int k = -2; k <= 2 && a != b; ++k)
          if (i != 0 && k != 0) sum += kFirst[i + 2] * kFirst[k + 2] * shifted(a, i, b, k);
      }
      second[a][b] = second[b][a] = sum / (step * step);
    }
  const double kappa = 1.0 - 2.0 * poissonRatio;
  double worst = 0.0;
  for (int force = 0; force < 3; ++force) {
    Vector3d residual = Vector3d::Zero();
    double size = 0.0;
    for (int i = 0; i < 3; ++i)
      for (int a = 0; a < 3; ++a) {
        const double laplacian = second[a][a](i, force), divergence = second[i][a](a, force);
        residual[i] += kappa * laplacian + divergence;
        size = std::max({size, kappa * std::abs(laplacian), std::abs(divergence)});
      }
    worst = std::max(worst, residual.norm() / size);
  }
  return worst;
}

/// Stress tensors under the three unit forces by Hooke's law.
inline std::array<Eigen::Matrix3d, 3> stressByDifferences(const Field& field, const Eigen::Vector3d& x, double step,
                                                          double youngsModulus, double poissonRatio) {
  using Eigen::Matrix3d, Eigen::Vector3d;
  std::array<Matrix3d, 3> gradient;  // [axis](component, force)
  for (int a = 0; a < 3; ++a) {
    const Vector3d d = step * Vector3d::Unit(a);
    gradient[a] = (8.0 * (field(x + d) - field(x - d)) - (field(x + 2 * d) - field(x - 2 * d))) / (12.0 * step);
  }
  const double shear = youngsModulus / (2.0 * (1.0 + poissonRatio));
  const double lame = 2.0 * shear * poissonRatio / (1.0 - 2.0 * poissonRatio);
  std::array<Matrix3d, 3> stress;
  for (int force = 0; force < 3; ++force) {
    Matrix3d slope;
    for (int a = 0; a < 3; ++a) slope.col(a) = gradient[a].col(force);
    stress[force] = shear * (slope + slope.transpose()) + lame * slope.trace() * Matrix3d::Identity();
  }
  return stress;
}

}  // namespace sensor::elastic
