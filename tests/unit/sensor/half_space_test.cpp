#include "sensor/elastic/half_space.h"
#include "sensor/elastic/quadrature.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace sensor::elastic {
namespace {

const std::vector<double> kPoissonRatios = {0.3, 0.45, 0.49, 0.4999};
const std::vector<Eigen::Vector3d> kOffsets = {
    {2e-3, 1e-3, 3e-3}, {-4e-3, 3e-3, 6e-3}, {0.0, 0.0, 5e-3}, {7e-3, -9e-3, 1e-3}, {-30e-3, 20e-3, 8e-3}};

/// Returns the derivative of a function of a distance along some axis, by fourth-order differences.
template <typename Function>
auto slope(const Function& at, double step) {
  return ((8.0 * (at(step) - at(-step)) - (at(2 * step) - at(-2 * step))) / (12.0 * step)).eval();
}

/// kappa lap(u) + grad(div u) = 0 under each of the three unit forces, by differences, in parts of the largest term.
TEST(HalfSpace, SatisfiesNaviersEquation) {
  for (const double poisson : kPoissonRatios)
    for (const Eigen::Vector3d& x : kOffsets) {
      const double step = 3e-3 * x.norm(), kappa = 1.0 - 2.0 * poisson;
      const auto field = [&](const Eigen::Vector3d& at) { return halfSpaceDisplacement(at, 0.18e6, poisson); };
      const auto divergence = [&](const Eigen::Vector3d& at) {
        Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
        for (int a = 0; a < 3; ++a)
          sum += slope([&](double by) { return field(at + by * Eigen::Vector3d::Unit(a)); }, step).row(a);
        return sum;
      };
      Eigen::Matrix3d laplacian = Eigen::Matrix3d::Zero(), gradient;
      double size = 0.0;
      for (int a = 0; a < 3; ++a) {
        const Eigen::Vector3d d = step * Eigen::Vector3d::Unit(a);
        const Eigen::Matrix3d second =
            (16.0 * (field(x + d) + field(x - d)) - (field(x + 2 * d) + field(x - 2 * d)) - 30.0 * field(x)) /
            (12.0 * step * step);
        laplacian += second;
        gradient.row(a) = slope([&](double by) { return divergence(x + by * Eigen::Vector3d::Unit(a)); }, step);
        size = std::max(size, kappa * second.colwise().norm().maxCoeff());
      }
      size = std::max(size, gradient.colwise().norm().maxCoeff());
      EXPECT_LT((kappa * laplacian + gradient).colwise().norm().maxCoeff(), 1e-5 * size)
          << poisson << " " << x.transpose();
    }
}

TEST(HalfSpace, TopIsFreeOfTraction) {
  for (const double poisson : kPoissonRatios)
    for (const auto& stress : halfSpaceStress({3e-3, -2e-3, 0.0}, poisson)) EXPECT_EQ(stress.col(2).norm(), 0.0);
}

// The plane at depth d, in polar coordinates with r = d tan(t): nothing is cut off.
TEST(HalfSpace, EveryPlaneCarriesTheForce) {
  const Rule rule = gauss(40);
  constexpr int kAngles = 16;
  for (const double poisson : kPoissonRatios)
    for (const double depth : {1e-3, 6e-3, 40e-3}) {
      Eigen::Matrix3d force = Eigen::Matrix3d::Zero();  // of the part above on the part below; column: unit force
      for (int i = 0; i < rule.points.size(); ++i) {
        const double t = 0.25 * std::numbers::pi * (1.0 + rule.points[i]);
        const double r = depth * std::tan(t);
        const double area = 0.25 * std::numbers::pi * rule.weights[i] * depth / std::pow(std::cos(t), 2) * r * 2.0 *
                            std::numbers::pi / kAngles;
        for (int k = 0; k < kAngles; ++k) {
          const double angle = 2.0 * std::numbers::pi * k / kAngles;
          const auto stress = halfSpaceStress({r * std::cos(angle), r * std::sin(angle), depth}, poisson);
          for (int j = 0; j < 3; ++j) force.col(j) -= area * stress[j].col(2);
        }
      }
      EXPECT_LT((force - Eigen::Matrix3d::Identity()).norm(), 1e-9) << poisson << " " << depth;
    }
}

}  // namespace
}  // namespace sensor::elastic
