#include "sensor/elastic/half_space.h"
#include "sensor/elastic/quadrature.h"
#include "tests/unit/sensor/elasticity.h"

#include <gtest/gtest.h>

#include <numbers>

namespace sensor::elastic {
namespace {

constexpr double kYoung = 0.18e6;
const std::vector<double> kPoissonRatios = {0.3, 0.45, 0.49, 0.4999};
const std::vector<Eigen::Vector3d> kOffsets = {
    {2e-3, 1e-3, 3e-3}, {-4e-3, 3e-3, 6e-3}, {0.0, 0.0, 5e-3}, {7e-3, -9e-3, 1e-3}, {-30e-3, 20e-3, 8e-3}};

Field field(double poisson) {
  return [poisson](const Eigen::Vector3d& x) { return halfSpaceDisplacement(x, kYoung, poisson); };
}

TEST(HalfSpace, SatisfiesNaviersEquation) {
  for (const double poisson : kPoissonRatios)
    for (const Eigen::Vector3d& x : kOffsets) {
      const double step = 3e-3 * x.norm();
      Eigen::Matrix3d gradientOfDivergence;
      for (int a = 0; a < 3; ++a) {
        const Eigen::Vector3d d = step * Eigen::Vector3d::Unit(a);
        const auto at = [&](int i) { return divergence(field(poisson), x + i * d, step); };
        gradientOfDivergence.row(a) = (8.0 * (at(1) - at(-1)) - (at(2) - at(-2))) / (12.0 * step);
      }
      EXPECT_LT(navierResidual(field(poisson), x, step, poisson, gradientOfDivergence), 1e-5)
          << poisson << " " << x.transpose();
    }
}

TEST(HalfSpace, StressIsHookesLawOnTheDisplacement) {
  for (const double poisson : kPoissonRatios)
    for (const Eigen::Vector3d& x : kOffsets) {
      const auto exact = halfSpaceStress(x, poisson);
      const auto numeric = stressByDifferences(field(poisson), x, 1e-3 * x.norm(), kYoung, poisson);
      for (int j = 0; j < 3; ++j)
        EXPECT_LT((exact[j] - numeric[j]).norm(), 1e-8 / x.squaredNorm()) << poisson << " " << x.transpose();
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
