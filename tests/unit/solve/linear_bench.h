// What the tests of linear posteriors and of linear models share.
#pragma once

#include "tests/unit/solve/model_bench.h"

#include <span>
#include <utility>
#include <vector>

namespace tractiond::solve {

using Eigen::Index;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

inline std::span<const double> all(const RowMajor& matrix) {
  return {matrix.data(), static_cast<std::size_t>(matrix.size())};
}
template <typename Matrix>
std::span<double> all(Matrix& matrix) {
  return {matrix.data(), static_cast<std::size_t>(matrix.size())};
}

/// Returns the coordinates of every seventh marker from the fourth one on.
inline std::vector<int> everySeventh(int coordinates) {
  std::vector<int> missing;
  for (int m = 3; 2 * m < coordinates; m += 7) missing.insert(missing.end(), {2 * m, 2 * m + 1});
  return missing;
}

/// Returns functionals of the points' forces, points x kColumns, and the points that they read.
inline std::pair<RowMajor, std::vector<int>> functionals(const Atoms& atoms) {
  RowMajor weights = RowMajor::Zero(3 * atoms.pointCount(), kColumns);
  std::vector<int> points;
  std::mt19937_64 generator(5);
  std::normal_distribution<double> normal;
  for (int point = atoms.pointCount() / 3; point < atoms.pointCount(); point += 2) {
    points.push_back(point);
    weights.middleRows<3>(3 * point) = MatrixXd::NullaryExpr(3, kColumns, [&] { return normal(generator); });
  }
  return {weights, points};
}

inline std::vector<float> rounded(const VectorXd& displacement_px) {
  std::vector<float> result(static_cast<std::size_t>(displacement_px.size()));
  Eigen::VectorXf::Map(result.data(), displacement_px.size()) = displacement_px.cast<float>();
  return result;
}

}  // namespace tractiond::solve
