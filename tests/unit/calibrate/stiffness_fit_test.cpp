#include "daemon/calibrate/stiffness_fit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace tractiond::calibrate::stiffness_fit_test {
namespace {

constexpr double kAssumed = 0.18e6, kTrue = 0.2e6;

WeighedForce weighed(double known_gf, double placed_gf, double deviation_N = 0.005) {
  return {known_gf * kGramForce, placed_gf * kGramForce * kAssumed / kTrue, deviation_N};
}

TEST(StiffnessFit, ScalesReadingsToWeights) {
  const Stiffness found = fitStiffness({weighed(100, 100), weighed(500, 500), weighed(200, 200)}, kAssumed);
  EXPECT_NEAR(found.youngsModulus, kTrue, 1e-9 * kTrue);
  EXPECT_NEAR(found.linearity, 0.0, 1e-9);
  EXPECT_EQ(found.contradiction, "");
  EXPECT_THAT(found.ofEach, testing::ElementsAre(testing::DoubleNear(kTrue, 1e-3), testing::DoubleNear(kTrue, 1e-3),
                                                 testing::DoubleNear(kTrue, 1e-3)));
}

TEST(StiffnessFit, DeviationIsTrue) {
  std::mt19937 generator(3);
  std::normal_distribution<double> normal;
  double square = 0.0;
  constexpr int kTrials = 500;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<WeighedForce> weights = {weighed(100, 100), weighed(200, 200), weighed(500, 500)};
    for (WeighedForce& one : weights) {
      one.read_N *= 1.0 + std::hypot(1e-3, 2e-3) * normal(generator);
      one.read_N += one.deviation_N * normal(generator);
    }
    const Stiffness found = fitStiffness(weights, kAssumed);
    const double off = (found.youngsModulus / kTrue - 1.0) / found.deviation;
    square += off * off;
  }
  EXPECT_GT(std::sqrt(square / kTrials), 0.6);  // weights that happen to disagree widen it
  EXPECT_LT(std::sqrt(square / kTrials), 1.1);
}

TEST(StiffnessFit, SaysWhatIsWrongWithTheWeights) {
  const auto complaint = [](const std::vector<WeighedForce>& weights) {
    return fitStiffness(weights, kAssumed).contradiction;
  };
  EXPECT_THAT(complaint({weighed(100, 100), weighed(200, 260), weighed(500, 500)}),
              testing::StartsWith("the weights contradict each other:"));
  EXPECT_THAT(complaint({weighed(100, 0)}), testing::StartsWith("100 gf does not press"));
}

TEST(StiffnessFit, TellsHowLinearTheGelIsAndIsAsUncertain) {
  const Stiffness found = fitStiffness({weighed(100, 101), weighed(500, 495)}, kAssumed);
  EXPECT_GT(found.linearity, 0.005);
  EXPECT_LT(found.linearity, 0.02);
  EXPECT_NEAR(found.deviation, 0.007, 0.001);  // three times what their readings state, as they disagree
  EXPECT_EQ(found.contradiction, "");
}

}  // namespace
}  // namespace tractiond::calibrate::stiffness_fit_test
