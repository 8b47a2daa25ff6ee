// What a field says of a gel that creeps, as far as its creep is known.
#include "tests/unit/solve/presses.h"

namespace tractiond::solve {
namespace {

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

}  // namespace
}  // namespace tractiond::solve
