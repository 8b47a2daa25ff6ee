#include "daemon/solve/large_strain.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

namespace tractiond::solve::large_strain_test {
namespace {

constexpr double kDepth_m = 6e-3, kYoung_Pa = 1.8e5;

/// 25 x 25 nodes, 3 mm apart.
sensor::Points nodes() {
  sensor::Points nodes = sensor::Points::Zero(3, 625);
  for (int n = 0; n < nodes.cols(); ++n) nodes.col(n).head<2>() << 3e-3 * (n % 25 - 12), 3e-3 * (n / 25 - 12);
  return nodes;
}

/// The strain below a force on the middle node: 3 F / (2 pi E depth^2) by Boussinesq; elsewhere by its distance.
TEST(LargeStrain, IsThatBelowAPointForceAtTheMarkersDepth) {
  LargeStrain strain(nodes(), kDepth_m, kYoung_Pa);
  const double limit_N = 0.25 * 2.0 * std::numbers::pi / 3.0 * kYoung_Pa * kDepth_m * kDepth_m;
  for (const int node : {312, 0}) {
    for (const int axis : {0, 2}) {
      std::vector<double> force_N(3 * 625);
      force_N[3 * node + axis] = 0.99 * limit_N;
      EXPECT_FALSE(strain.outOfRange(force_N)) << node << ", " << axis;
      force_N[3 * node + axis] = -1.01 * limit_N;
      EXPECT_TRUE(strain.outOfRange(force_N)) << node << ", " << axis;
    }
  }
  // At 6 mm to the side, what a force does there is 2^-2.5 of that below it.
  std::vector<double> force_N(3 * 625);
  force_N[3 * 312 + 2] = force_N[3 * 314 + 2] = 0.98 * limit_N / (1.0 + std::pow(2.0, -2.5));
  EXPECT_FALSE(strain.outOfRange(force_N));
  force_N[3 * 312 + 2] = force_N[3 * 314 + 2] = 1.02 * limit_N / (1.0 + std::pow(2.0, -2.5));
  EXPECT_TRUE(strain.outOfRange(force_N));
}

}  // namespace
}  // namespace tractiond::solve::large_strain_test
