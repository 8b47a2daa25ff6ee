// The touched surface's own displacement, against the fields of point forces that the rest of the mechanics uses.
#include "sensor/elastic/half_space.h"
#include "sensor/elastic/surface.h"

#include <gtest/gtest.h>

#include <iostream>
#include <random>

namespace sensor::elastic {
namespace {

constexpr double kModulus = 0.05e6, kRatio = 0.49, kPitch = 2e-3;

std::mt19937 drawn() {
  const unsigned seed = std::random_device()();
  std::cout << "  seed " << seed << "\n";
  return std::mt19937(seed);
}

/// The square as points, by the midpoint rule.
Eigen::Matrix3d byPoints(const Eigen::Vector2d& offset, int side) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (int i = 0; i < side; ++i) {
    for (int j = 0; j < side; ++j) {
      const Eigen::Vector2d at((i + 0.5) / side - 0.5, (j + 0.5) / side - 0.5);
      const Eigen::Vector2d from = offset - kPitch * at;
      sum += halfSpaceDisplacement({from.x(), from.y(), 0.0}, kModulus, kRatio);
    }
  }
  return sum / (side * side);
}

TEST(HalfSpaceSquare, IsTheIntegralOfPointForces) {
  auto chance = drawn();
  std::uniform_real_distribution<double> place(-4.0 * kPitch, 4.0 * kPitch);
  double worst = 0.0;
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector2d offset(place(chance), place(chance));
    const Eigen::Matrix3d expected = byPoints(offset, 200);
    const Eigen::Matrix3d is = halfSpaceSquare(offset, kPitch, kModulus, kRatio);
    worst = std::max(worst, (is - expected).cwiseAbs().maxCoeff() / expected.cwiseAbs().maxCoeff());
  }
  std::cout << "  at most " << worst << " of the largest\n";
  EXPECT_LT(worst, 0.005);  // what the midpoint rule errs by where the target lies in the square
}

TEST(HalfSpaceSquare, IsLovesUnderItsCentre) {
  const Eigen::Matrix3d u = halfSpaceSquare({0.0, 0.0}, kPitch, kModulus, kRatio);
  // Love (1929): 4 ln(1 + sqrt 2) / pi (1 - nu^2) / (E side).
  EXPECT_NEAR(u(2, 2) * kPitch * kModulus / (1.0 - kRatio * kRatio), 4.0 * std::log(1.0 + std::sqrt(2.0)) / M_PI,
              1e-12);
  EXPECT_NEAR(u(0, 0), u(1, 1), 1e-12 * u(0, 0));
  EXPECT_NEAR(u.cwiseAbs().sum(), u.diagonal().sum(), 1e-12 * u(2, 2));
}

TEST(HalfSpaceSquare, IsFiniteOnEdgesAndCorners) {
  for (const double x : {0.0, 0.5, -0.5}) {
    for (const double y : {0.0, 0.5, -0.5}) {
      EXPECT_TRUE(halfSpaceSquare({x * kPitch, y * kPitch}, kPitch, kModulus, kRatio).allFinite()) << x << ", " << y;
    }
  }
}

TEST(SurfaceMatrix, FarFromAForceIsThatOfPointForces) {
  Gel gel;
  Points nodes(3, 9);
  for (int i = 0; i < 9; ++i) nodes.col(i) << kPitch * (i % 3 - 1), kPitch * (i / 3 - 1), 0.0;
  Points all(3, 10);
  all << nodes, Eigen::Vector3d(8.0 * kPitch, 0.0, 0.0);
  const Eigen::MatrixXd u = surfaceMatrix(gel, all, kPitch);
  const Eigen::MatrixXd expected = blockDisplacement(gel, all.rightCols(1), nodes);
  const Eigen::MatrixXd is = u.block(27, 0, 3, 27);
  EXPECT_LT((is - expected).cwiseAbs().maxCoeff(), 0.005 * expected.cwiseAbs().maxCoeff());
  // Betti: what a force at one node does at another, the other does at the one.
  EXPECT_LT((u - u.transpose()).cwiseAbs().maxCoeff(), 0.01 * u.cwiseAbs().maxCoeff());
}

}  // namespace
}  // namespace sensor::elastic
