// What a field says of a gel that creeps, as far as its creep is known, and of one that may be warmer than at its zero.
#include "tests/unit/solve/presses.h"

namespace tractiond::solve {
namespace {

constexpr double kPerKelvin_N = 0.014;

/// The solver of a gel of which a kelvin changes each force by so much.
ModelSolver& warmSolver() {
  static const Factors factors = [] {
    Factors made = makePaperFactors();
    for (const std::size_t axis : {0U, 1U, 2U}) made.systematicErrors.contactHeat[7 * axis] = square(kPerKelvin_N);
    return made;
  }();
  static ModelSolver solver(factors, paperAtoms(), paper());
  return solver;
}

class CreepTest : public PressTest {
 protected:
  /// A picture of presses of a ball [N, into the gel] now, where one deviation of the creep is worth `remembered` of
  /// another picture.
  MarkerField frame(const VectorXd& now, const VectorXd& remembered) {
    MarkerField markers = seen(now);
    markers.elastic_px.assign(now.data(), now.data() + now.size());
    markers.creepErrors_px.assign(remembered.data(), remembered.data() + remembered.size());
    markers.creepError_px = static_cast<float>(remembered.norm());
    return markers;
  }
  VectorXd pressed(double force_N, const Vector2d& at) const { return force_N * press(at, 4e-3).image.col(2); }

  MarkerField warm(const VectorXd& now, float deviation_K) {
    MarkerField markers = seen(now);
    markers.heatDeviation_K = deviation_K;
    return markers;
  }

  const Vector2d here_{-12e-3, 6e-3}, there_{15e-3, -9e-3};
};

TEST_F(CreepTest, AHeldForceIsAsUncertainAsItsCreep) {
  solve(frame(pressed(2.0, here_) + noise(), pressed(0.04, here_)));
  const double without = field_.systematic[14];
  EXPECT_EQ(field_.flags & kRecovering, 0U);
  ASSERT_EQ(field_.contactCount, 1);
  MarkerField sure = seen(pressed(2.0, here_) + noise());
  solve(sure);
  EXPECT_NEAR(without - field_.systematic[14], 0.04 * 0.04, 0.1 * 0.04 * 0.04);
}

TEST_F(CreepTest, WhatTheGelMayRememberIsNoContact) {
  for (int i = 0; i < 20; ++i) {
    solve(frame(pressed(0.08, here_) + noise(), pressed(0.04, here_)));
    EXPECT_EQ(field_.method, Method::kNoContact);
    EXPECT_EQ(field_.contactCount, 0);
    EXPECT_EQ(resultant(), Vector3d::Zero());
    EXPECT_NE(field_.flags & kRecovering, 0U);
    EXPECT_GT(1.96 * std::sqrt(field_.noise[14] + field_.systematic[14]), 0.05);
  }
}

TEST_F(CreepTest, ANewTouchIsListedAtOnceWhereItIs) {
  for (const Vector2d& at : {here_, there_}) {
    solve(frame(pressed(0.4, at) + noise(), pressed(0.04, here_)));
    EXPECT_EQ(field_.method, Method::kContact);
    ASSERT_EQ(field_.contactCount, 1);
    EXPECT_NEAR(field_.contacts[0].force_N[2], 0.4, 0.05);
    EXPECT_NEAR(field_.contacts[0].position_m[0], at.x(), 1e-3);
  }
}

TEST_F(CreepTest, OfTwoTheOneThatMayBeRememberedIsNotListed) {
  solve(frame(pressed(2.0, there_) + pressed(0.1, here_) + noise(), pressed(0.1, here_)));
  ASSERT_EQ(field_.contactCount, 1);
  EXPECT_NEAR(field_.contacts[0].position_m[0], there_.x(), 1e-3);
  EXPECT_NE(field_.flags & kRecovering, 0U);
}

TEST_F(CreepTest, WellKnownCreepIsNotFlagged) {
  solve(frame(noise(), pressed(1e-3, here_)));
  EXPECT_EQ(field_.method, Method::kNoContact);
  EXPECT_EQ(field_.flags & kRecovering, 0U);
}

TEST_F(CreepTest, AHeldForceIsAsUncertainAsTheTemperature) {
  const VectorXd picture = pressed(2.0, here_) + noise();
  warmSolver().solve(warm(picture, 3.0F), field_);
  ASSERT_EQ(field_.contactCount, 1);
  const double with = field_.systematic[14], ofContact = field_.contacts[0].systematic[14];
  warmSolver().solve(warm(picture, 0.0F), field_);
  for (const double variance : {with - field_.systematic[14], ofContact - field_.contacts[0].systematic[14]}) {
    EXPECT_NEAR(std::sqrt(variance), 3.0 * kPerKelvin_N, 0.03 * kPerKelvin_N);
  }
}

TEST_F(CreepTest, WhatHeatMayDoIsNoContactAndSaidSo) {
  warmSolver().solve(warm(pressed(0.1, here_) + noise(), 0.0F), field_);
  ASSERT_EQ(field_.contactCount, 1);
  warmSolver().solve(warm(pressed(0.1, here_) + noise(), 5.0F), field_);
  EXPECT_EQ(field_.method, Method::kNoContact);
  EXPECT_NE(field_.flags & kRecovering, 0U);
  EXPECT_GT(1.96 * std::sqrt(field_.noise[14] + field_.systematic[14]), 0.1);
  warmSolver().solve(warm(noise(), 0.05F), field_);
  EXPECT_EQ(field_.flags & kRecovering, 0U);
}

}  // namespace
}  // namespace tractiond::solve
