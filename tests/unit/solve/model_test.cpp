// What the model of contacts finds; golden recordings hold its numbers.
#include "tests/unit/solve/model_bench.h"

#include <gtest/gtest.h>

namespace tractiond::solve {
namespace {

sensor::Sensor mediumSensor() {
  sensor::Sensor sensor;
  for (sensor::MarkerLayer& layer : sensor.layers) layer.columns = layer.rows = 12;
  sensor.nodes.columns = sensor.nodes.rows = 12;
  return sensor;
}

TEST(Model, ForcesGrowWithTheStiffness) {
  sensor::Sensor soft = smallSensor(), stiff = soft;
  stiff.gel.youngsModulus *= 10.0;
  Bench a(soft), b(stiff);
  const VectorXd displacement = a.picture({{1, 2, kPress}, {-6, 0, 0.1 * kShear}}, 5);
  const Estimate one = a.solve(displacement), ten = b.solve(displacement);
  EXPECT_EQ(one.atoms, ten.atoms);
  EXPECT_LT((10.0 * forcesOf(one) - forcesOf(ten)).cwiseAbs().maxCoeff(), 1e-4 * forcesOf(ten).cwiseAbs().maxCoeff());
  EXPECT_LT((100.0 * covarianceOf(one) - covarianceOf(ten)).norm(), 1e-4 * covarianceOf(ten).norm());
}

TEST(Model, LeavingFaintModesOutDoesNotShow) {
  SolveOptions options = everyMode();
  options.faintest = SolveOptions().faintest;
  Bench every(mediumSensor()), strong(mediumSensor(), options);
  EXPECT_LT(strong.factors().rank(), every.factors().rank());
  for (const Load& load : {Load{{1, 2, kPress}}, Load{{-14, 9, 0.05 * kPress}}, square(3, 0, 9, 3)}) {
    const VectorXd displacement = every.picture(load, 7);
    EXPECT_LT(differenceInDeviations(every.solve(displacement), wrenchOf(strong.solve(displacement))), 0.2);
  }
}

TEST(Model, FollowsTheFramesNoise) {
  SolveOptions loud = everyMode();
  loud.noise_px = 3.0 * kNoise_px;
  Bench calibrated(smallSensor()), noisy(smallSensor(), loud);
  const VectorXd displacement = noisy.picture({{1, 2, kPress}}, 9, loud.noise_px);
  const Estimate estimate = calibrated.solve(displacement, {}, loud.noise_px);
  const Estimate expected = noisy.solve(displacement, {}, loud.noise_px);
  EXPECT_LT(differenceInDeviations(estimate, wrenchOf(expected)), 0.3);
  EXPECT_NEAR(covarianceOf(estimate)(2, 2), covarianceOf(expected)(2, 2), 0.1 * covarianceOf(expected)(2, 2));
}

}  // namespace
}  // namespace tractiond::solve
