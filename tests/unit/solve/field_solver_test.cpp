// What is said of every field: which fields are valid, what they carry, what does not last.
#include "daemon/solve/model_solver.h"
#include "tests/unit/solve/sensors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <optional>
#include <random>

namespace tractiond::solve::field_solver_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

double number(std::mt19937& random) {
  return std::normal_distribution<double>()(random);
}

/// Returns displacements under random forces at every fifth node component, with tracking noise.
MarkerField loaded(const Eigen::MatrixXd& influence, std::mt19937& random) {
  Eigen::VectorXd forces = Eigen::VectorXd::Zero(influence.cols());
  for (Eigen::Index i = 0; i < forces.size(); i += 5) forces[i] = number(random);
  Eigen::VectorXd displacement = influence * forces;
  for (double& d : displacement) d += 0.02 * number(random);
  return fieldOf(displacement);
}

void loseAtRandom(MarkerField& field, int count, std::mt19937& random) {
  std::uniform_int_distribution<std::size_t> marker(0, field.valid.size() - 1);
  while (count > 0) {
    const auto candidate = static_cast<int>(marker(random));
    count -= field.valid[candidate];
    loseMarker(field, candidate);
  }
}

class FieldSolverTest : public testing::Test {
 protected:
  FieldSolverTest() {
    forces_.resize(sensor_.markerCount(), sensor_.nodes.count());
    const MatrixXd image = halfSpaceImage(sensor_, atoms_.points);
    const double scale_N = sensor_.gel.youngsModulus * square(sensor_.nodes.pitch);
    factors_ = computeFactors(image, atoms_, still(image.rows()), scale_N, SolveOptions{}).value();
    solver_.emplace(factors_, atoms_, sensor_);
  }

  VectorXd solved(const MarkerField& field) {
    solver_->solve(field, forces_);
    EXPECT_TRUE(forces_.valid);
    return Eigen::VectorXf::Map(forces_.force_N.data(), influence_.cols()).cast<double>();
  }

  void expectNothing(std::uint32_t flags) {
    EXPECT_FALSE(forces_.valid);
    EXPECT_EQ(forces_.flags, flags);
    for (const float force : forces_.force_N) EXPECT_EQ(force, 0.0F);
    EXPECT_EQ(forces_.resultant_N, (std::array<double, 3>{}));
    EXPECT_EQ(forces_.moment_Nm, (std::array<double, 3>{}));
    EXPECT_FALSE(forces_.centreOfPressureValid);
    EXPECT_EQ(forces_.residual_px, 0.0);
  }

  const sensor::Sensor sensor_ = smallSensor();
  const MatrixXd influence_ = halfSpaceImage(sensor_, sensor::nodePositions(sensor_.nodes));
  const Atoms atoms_ = makeAtoms(sensor_);
  Factors factors_;
  std::optional<ModelSolver> solver_;
  TractionField forces_;
  std::mt19937 random_{1};
};

TEST_F(FieldSolverTest, GelWhoseForcesCannotBeSeenIsRefused) {
  const MatrixXd faint = 1e-9 * halfSpaceImage(sensor_, atoms_.points);
  const auto made = computeFactors(faint, atoms_, still(faint.rows()), factors_.force_N, SolveOptions{});
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().exitCode, EX_CONFIG);
}

TEST_F(FieldSolverTest, WhatIsSaidOfAMissingMarkerDoesNotMatter) {
  MarkerField field = loaded(influence_, random_);
  loseMarker(field, 17);
  const VectorXd expected = solved(field);
  field.displacement_px[34] = 1e6F;
  field.displacement_px[35] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(solved(field), expected);
}

TEST_F(FieldSolverTest, FewMarkersGiveNoField) {
  MarkerField field = loaded(influence_, random_);
  const MarkerField whole = field;
  field.flags = kFewMarkers;  // the tracker gives it up
  solver_->solve(field, forces_);
  expectNothing(kFewMarkers);
  field.flags = 0;
  loseAtRandom(field, sensor_.markerCount() / 4, random_);
  solved(field);
  loseAtRandom(field, 1, random_);
  field.flags = kDiscontinuity;
  solver_->solve(field, forces_);
  expectNothing(kDiscontinuity | kFewMarkers);
  solved(whole);
}

TEST_F(FieldSolverTest, PoisonGivesNoFieldAndDoesNotLast) {
  const MarkerField whole = loaded(influence_, random_);
  const VectorXd expected = solved(whole);
  std::uint64_t count = 0;
  for (const float poison : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
                             -std::numeric_limits<float>::infinity(), std::numeric_limits<float>::max()}) {
    for (const int lost : {0, 3}) {
      MarkerField field = whole;
      for (int i = 0; i < lost; ++i) loseMarker(field, 10 + i);
      field.displacement_px[5] = poison;
      solver_->solve(field, forces_);
      if (std::isfinite(poison) && forces_.valid) continue;  // large, but a number
      expectNothing(0);
      ++count;
      EXPECT_TRUE(forces_.work.failed);
      EXPECT_EQ(solved(whole), expected);
      EXPECT_FALSE(forces_.work.failed);
      EXPECT_GT(forces_.work.rounds, 0);
      EXPECT_GT(forces_.work.atoms, 0);
    }
  }
  EXPECT_GE(count, 6U) << "NaN and infinities are no numbers";
}

TEST_F(FieldSolverTest, AModelAnswersWhileItIsInForce) {
  constexpr std::int64_t kMs = 1'000'000;
  MarkerField field = loaded(influence_, random_);
  const auto isAnswered = [&](std::uint64_t frame, std::int64_t received_ns) {
    field.info.frameNumber = frame;
    field.info.times.received_ns = received_ns;
    return solver_->answer(field, forces_);
  };
  EXPECT_FALSE(isAnswered(10, 0)) << "there is no model yet";
  solved(field);
  const TractionField whole = forces_;
  EXPECT_EQ(whole.solution, Solution::kFull);
  ASSERT_TRUE(solver_->learn());
  ASSERT_TRUE(isAnswered(11, 100 * kMs));
  EXPECT_FALSE(solver_->wantsModel());
  EXPECT_TRUE(forces_.valid);
  EXPECT_EQ(forces_.solution, Solution::kLinear);
  EXPECT_EQ(forces_.modelFrame, 10U);
  EXPECT_EQ(forces_.markers.info.frameNumber, 11U);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(forces_.resultant_N[axis], whole.resultant_N[axis], 0.5 * std::sqrt(whole.noise[7 * axis]));
  }
  for (float& displacement : field.displacement_px) displacement *= 0.8F;
  EXPECT_TRUE(isAnswered(11, 100 * kMs));
  EXPECT_TRUE(solver_->wantsModel()) << "its prior is wider than a smaller force needs";
  for (float& displacement : field.displacement_px) displacement /= 0.8F;
  EXPECT_TRUE(isAnswered(18, 800 * kMs)) << "it is eight frames old";
  EXPECT_TRUE(solver_->wantsModel());
  EXPECT_FALSE(isAnswered(19, 800 * kMs));
  EXPECT_TRUE(isAnswered(60, 50 * kMs)) << "it is 50 ms old";
  EXPECT_FALSE(isAnswered(10, 0)) << "its own frame, or one before, comes from elsewhere";
  field.zero[0] = 1;
  EXPECT_FALSE(isAnswered(11, 0)) << "the displacements are from another zero";
}

TEST_F(FieldSolverTest, AFrameThatNothingTouchesNeedsNoModel) {
  MarkerField field = loaded(influence_, random_);
  for (float& displacement : field.displacement_px) displacement *= 1e-4F;
  solver_->solve(field, forces_);
  const TractionField whole = forces_;
  ASSERT_EQ(whole.method, Method::kNoContact);
  ASSERT_TRUE(solver_->answer(field, forces_));
  EXPECT_EQ(forces_.method, Method::kNoContact);
  EXPECT_EQ(forces_.solution, Solution::kFull);
  EXPECT_EQ(forces_.noise, whole.noise);
  EXPECT_EQ(forces_.pictureMotion, whole.pictureMotion);
  EXPECT_EQ(forces_.residual_px, whole.residual_px);
}

TEST_F(FieldSolverTest, IsolatedGapsOfTheZeroAreNotAmongTheMarkersThatMayBeMissing) {
  MarkerField field = loaded(influence_, random_);
  const int markers = sensor_.markerCount(), gaps = markers / 4, others = (markers - gaps) / 4;
  loseAtRandom(field, gaps + others, random_);
  field.isolatedGaps = gaps;
  solved(field);
  loseAtRandom(field, 1, random_);
  solver_->solve(field, forces_);
  expectNothing(kFewMarkers);
}

TEST_F(FieldSolverTest, WithoutAPressThereIsNoCentre) {
  VectorXd forces = VectorXd::Zero(influence_.cols());
  for (const double normal : {0.0, 0.02, -2.0}) {  // below SolveOptions::minPressForCentre_N
    forces[2] = normal;
    forces[0] = 1.0;
    solved(fieldOf(influence_ * forces));
    EXPECT_FALSE(forces_.centreOfPressureValid);
    EXPECT_EQ(forces_.centreOfPressure_m, (std::array<double, 2>{}));
  }
}

TEST_F(FieldSolverTest, ForcesAddUpToTheResultant) {
  solved(loaded(influence_, random_));
  Eigen::Vector3d resultant = Eigen::Vector3d::Zero();
  for (Eigen::Index n = 0; n < sensor_.nodes.count(); ++n) {
    resultant += Eigen::Vector3f::Map(forces_.force_N.data() + 3 * n).cast<double>();
  }
  for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(forces_.resultant_N[axis], resultant[axis], 1e-5);
}

TEST_F(FieldSolverTest, WhatIsTooWeakToBeFoundMayActAnywhere) {
  solved(fieldOf(VectorXd::Zero(influence_.rows())));
  ASSERT_EQ(forces_.method, Method::kNoContact);
  const auto [shear, press] = solver_->detectionLimit_N();
  for (const int axis : {0, 1, 2}) {
    EXPECT_DOUBLE_EQ(std::sqrt(forces_.noise[7 * axis]), 0.5 * (axis < 2 ? shear : press));
  }
  const sensor::Points nodes = sensor::nodePositions(sensor_);
  const double x = nodes.row(0).cwiseAbs().maxCoeff(), y = nodes.row(1).cwiseAbs().maxCoeff();
  // Evenly over n nodes of a pitch, a side's mean square is (n^2 - 1) / 12 pitch^2: a share of its half's square.
  const auto meanSquare = [](double half, int count) { return half * half * (count + 1) / (3.0 * (count - 1)); };
  const double xx = meanSquare(x, sensor_.nodes.columns), yy = meanSquare(y, sensor_.nodes.rows);
  EXPECT_NEAR(forces_.noise[21], yy * forces_.noise[14], 1e-9 * forces_.noise[21]);
  EXPECT_NEAR(forces_.noise[28], xx * forces_.noise[14], 1e-9 * forces_.noise[28]);
  EXPECT_NEAR(forces_.noise[35], (xx + yy) * forces_.noise[0], 1e-9 * forces_.noise[35]);
}

TEST_F(FieldSolverTest, ALimitThatIsNeverReachedIsInfiniteAndTheNoiseFinite) {
  solver_.emplace(factors_, atoms_, sensor_, SolveOptions{.noise_px = 1e4});
  for (const double limit_N : solver_->detectionLimit_N()) EXPECT_EQ(limit_N, std::numeric_limits<double>::infinity());
  solved(fieldOf(VectorXd::Zero(influence_.rows())));
  ASSERT_EQ(forces_.method, Method::kNoContact);
  for (const int axis : {0, 1, 2}) {
    EXPECT_GT(std::sqrt(forces_.noise[7 * axis]), 5.0 * factors_.force_N);
    EXPECT_TRUE(std::isfinite(forces_.noise[7 * axis]));
  }
}

TEST_F(FieldSolverTest, WhatActsBeyondTheNodesIsPublishedAtTheNearest) {
  const Eigen::Vector3d at(-10.5e-3, 1.5e-3, 0.0), force(0.3, 0.0, 1.0);  // 1.5 pitches beyond
  MarkerField markers = fieldOf(halfSpaceImage(sensor_, at) * force);
  solved(markers);
  EXPECT_LT((Eigen::Vector3d::Map(forces_.resultant_N.data()) - force).norm(), 0.05 * force.norm());
  ASSERT_TRUE(forces_.centreOfPressureValid);
  EXPECT_NEAR(forces_.centreOfPressure_m[0], at.x(), 0.5e-3);
  EXPECT_NEAR(forces_.centreOfPressure_m[1], at.y(), 0.5e-3);
  EXPECT_LT(forces_.centreOfPressure_m[0], sensor::nodePositions(sensor_.nodes)(0, 0) - 0.5e-3);
  ASSERT_GE(forces_.contactCount, 1);
  EXPECT_NEAR(forces_.contacts[0].position_m[0], at.x(), 0.5e-3);
}

}  // namespace
}  // namespace tractiond::solve::field_solver_test
