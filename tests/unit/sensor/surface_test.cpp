// The touched surface's own displacement, against the fields of point forces that the rest of the mechanics uses.
#include "sensor/elastic/half_space.h"
#include "sensor/elastic/surface.h"
#include "tests/support/seed.h"

#include <gtest/gtest.h>

#include <iostream>
#include <random>

namespace sensor::elastic {
namespace {

constexpr double kModulus = 0.05e6, kRatio = 0.49, kPitch = 2e-3;

/// Integrates point forces over the square by the midpoint rule, with cells that shrink cubically towards the point of
/// the square that is nearest to the target, where the integrand may be singular.
Eigen::Matrix3d byPoints(const Eigen::Vector2d& offset, int cells) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  const Eigen::Array2d target = offset / kPitch;  // the square is from -1/2 to 1/2
  const Eigen::Array2d nearest = target.max(-0.5).min(0.5);
  for (const double right : {-0.5, 0.5}) {
    for (const double top : {-0.5, 0.5}) {
      const Eigen::Array2d size = Eigen::Array2d(right, top) - nearest;
      for (int i = 0; i < cells; ++i) {
        for (int j = 0; j < cells; ++j) {
          const Eigen::Array2d step((i + 0.5) / cells, (j + 0.5) / cells);
          const Eigen::Array2d from = kPitch * (target - nearest - size * step.cube());
          const double area = (3.0 * size * step.square() / cells).prod();
          sum += std::abs(area) * halfSpaceDisplacement({from.x(), from.y(), 0.0}, kModulus, kRatio);
        }
      }
    }
  }
  return sum;
}

TEST(HalfSpaceSquare, IsTheIntegralOfPointForces) {
  std::mt19937 chance(tractiond::test::seed());
  std::uniform_real_distribution<double> place(-4.0 * kPitch, 4.0 * kPitch);
  double worst = 0.0;
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector2d offset(place(chance), place(chance));
    const Eigen::Matrix3d expected = byPoints(offset, 100);
    const Eigen::Matrix3d is = halfSpaceSquare(offset, kPitch, kModulus, kRatio);
    worst = std::max(worst, (is - expected).cwiseAbs().maxCoeff() / expected.cwiseAbs().maxCoeff());
  }
  std::cout << "  at most " << worst << " of the largest\n";
  EXPECT_LT(worst, 1e-4);  // the midpoint rule's error
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
