// What the tests of linear posteriors and of linear models share.
#pragma once

#include "daemon/solve/linear_model.h"
#include "tests/unit/solve/model_bench.h"

#include <gtest/gtest.h>

#include <memory>
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

/// The forces that are known, their model and what it answers.
class LinearBench : public Bench {
 public:
  /// \param hasPatches false: of the field alone
  explicit LinearBench(bool hasPatches = true)
      : Bench(smallSensor(), everyMode(), blockImage, hasPatches)
      , modes_(factors(), atoms(), everyMode())
      , linear_(factors(), atoms(), modes_.strong()) {
    later_.force_N.resize(3 * atoms().pointCount());
  }

  /// Solves a picture, and makes a linear model of it.
  Estimate make(const VectorXd& picture, const std::vector<int>& missing = {}) {
    Estimate estimate = solve(picture, missing);
    EXPECT_EQ(estimate.outcome, Estimate::Outcome::kFound);
    EXPECT_TRUE(linear_.make(model(), estimate, scratch_));
    return estimate;
  }

  bool answer(const VectorXd& picture, const std::vector<int>& missing = {}, double noise_px = kNoise_px) {
    const Picture now(factors(), picture, missing, noise_px);
    modes_.look(now);
    return linear_.answer(now, modes_, later_);
  }

  const Estimate& later() const { return later_; }
  LinearModel& linear() { return linear_; }

 private:
  Modes modes_;
  LinearModel linear_;
  LinearScratch scratch_;
  Estimate later_;
};

/// Returns the centre of the normal forces [m].
inline Eigen::Vector2d centreOf_m(const Load& load) {
  const VectorXd wrench = wrenchOf(load);
  return {-wrench[4] / wrench[2], wrench[3] / wrench[2]};
}

inline Load moved(Load load, double x_mm, double y_mm, double times = 1.0) {
  for (PointForce& at : load) at = {at.x_mm + x_mm, at.y_mm + y_mm, times * at.force};
  return load;
}

/// Returns the forces of the nodes.
inline VectorXd nodeForces(const Estimate& estimate, const Atoms& atoms) {
  VectorXd nodes(3 * atoms.nodeCount());
  addAtNodes(atoms, estimate.force_N, all(nodes));
  return nodes;
}

}  // namespace tractiond::solve
