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

TEST(Atoms, OfThePapersGel) {
  const sensor::Sensor sensor;
  const Atoms atoms = makeAtoms(sensor);
  EXPECT_EQ(atoms.pointCount(), 28 * 28);
  EXPECT_EQ(atoms.count(), 28 * 28 + 13 * 13 + 7 * 7 + 3 * 3 + 1 + 3 * 4 * 3);
  ASSERT_EQ(atoms.levels.size(), 6U);
  EXPECT_EQ(atoms.levels[0].end, atoms.pointCount());
  EXPECT_EQ(atoms.levels[5].end, atoms.count());
  EXPECT_DOUBLE_EQ(atoms.levels[3].reach_m, 3e-3);
  EXPECT_DOUBLE_EQ(atoms.levels[4].reach_m, 9e-3);
  EXPECT_FALSE(atoms.levels[2].ambiguous);
  EXPECT_TRUE(atoms.levels[3].ambiguous);
  EXPECT_DOUBLE_EQ(atoms.levels[2].spacing_m, 12e-3);
  EXPECT_DOUBLE_EQ(atoms.depth_m, 6e-3);
  const sensor::Points nodes = sensor::nodePositions(sensor);
  int beyond = 0;
  for (int p = 0; p < atoms.pointCount(); ++p) {
    const auto squares = (nodes.colwise() - atoms.points.col(p)).colwise().squaredNorm();
    EXPECT_NEAR((atoms.points.col(atoms.nearest[p]) - atoms.points.col(p)).squaredNorm(), squares.minCoeff(), 1e-12);
    if (atoms.nodes[p] < 0) {
      ++beyond;
    } else {
      EXPECT_EQ(atoms.nearest[p], p);
      EXPECT_LT((atoms.points.col(p) - nodes.col(atoms.nodes[p])).norm(), 1e-12);
    }
  }
  EXPECT_EQ(beyond, 28 * 28 - 24 * 24);
  const MatrixXd shape = atoms.shape;
  EXPECT_LT((shape.colwise().sum().array() - 1.0).abs().maxCoeff(), 1e-12);
  for (int p = 0; p < atoms.pointCount(); ++p) {
    if (atoms.nodes[p] >= 0) continue;
    EXPECT_EQ(shape.row(p).segment(atoms.pointCount(), atoms.levels[4].end - atoms.pointCount()).sum(), 0.0);
  }
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
