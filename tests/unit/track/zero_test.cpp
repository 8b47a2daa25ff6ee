// Zeros that are taken: of the first start, requested, refused, taken back.
#include "daemon/track/rest_pose.h"
#include "tests/support/seed.h"
#include "tests/unit/track/zero_bench.h"

#include <gtest/gtest.h>

namespace tractiond::track::zero_test {
namespace {

TEST(Zero, AFirstStartsIsUnverifiedAndARequestedOneIsVerified) {
  Scene scene;
  Started tracking(scene);
  RestPose first = tracking.takeZero();
  EXPECT_FALSE(first.requested);
  EXPECT_EQ(first.id, idOf(first));
  EXPECT_TRUE(tracking.field.flags & kZeroUnverified);
  shoot(scene, tracking, 20);
  EXPECT_TRUE(tracking.field.flags & kZeroUnverified);  // it agrees with itself only

  tracking.tracker.requestZero();
  shoot(scene, tracking, kZeroFrames);
  EXPECT_EQ(tracking.tracker.zeroState(), ZeroState::kTaken);
  shoot(scene, tracking, 1);
  EXPECT_FALSE(tracking.field.flags & kZeroUnverified);
  RestPose second = tracking.takeZero();
  EXPECT_FALSE(tracking.tracker.takeRestPose(second));
  EXPECT_TRUE(second.requested);
  EXPECT_NE(second.id, first.id);
  EXPECT_EQ(tracking.field.zero, second.id);
  EXPECT_NEAR(second.noise, 2.0, 0.1);
  EXPECT_NEAR(second.crossTalk[0], 0.2, 0.02);
  EXPECT_NEAR(second.crossTalk[1], 0.2, 0.02);
}

TEST(Zero, IsRefusedWhileMarkersMove) {
  struct Case {
    const char* name;
    Scene::Field (*field)(int frame);
  };
  const Case cases[] = {{"pressed slowly", [](int frame) -> Scene::Field { return press(0.05 * frame); }},
                        {"let go", [](int frame) -> Scene::Field { return press(frame < 15 ? 1.0 : 0.0); }},
                        {"trembling finger", [](int frame) -> Scene::Field { return press(frame % 2 ? 0.6 : 0.0); }},
                        {"camera shaken", [](int frame) -> Scene::Field {
                           return [frame](const Eigen::Vector2d&) {
                             return Eigen::Vector2d(0.2 * std::sin(0.7 * frame), 0.0);
                           };
                         }}};
  for (const Case& c : cases) {
    Scene scene;
    Started tracking(scene);
    RestPose pose = tracking.takeZero();
    tracking.tracker.requestZero();
    for (int i = 0; i < kZeroFrames; ++i) {
      scene.displace(c.field(i));
      shoot(scene, tracking, 1);
    }
    EXPECT_EQ(tracking.tracker.zeroState(), ZeroState::kMoving) << c.name;
    EXPECT_FALSE(tracking.tracker.takeRestPose(pose)) << c.name;
    EXPECT_EQ(tracking.field.zero, pose.id) << c.name;
    EXPECT_TRUE(tracking.field.flags & kZeroUnverified) << c.name;
  }
}

TEST(Zero, AFaintVibrationOfThePictureIsAveraged) {
  Scene scene;
  Started tracking(scene);
  tracking.tracker.requestZero();
  for (int i = 0; i < kZeroFrames; ++i) {
    scene.displace([i](const Eigen::Vector2d&) { return Eigen::Vector2d(0.02 * std::sin(1.3 * i), 0.0); });
    shoot(scene, tracking, 1);
  }
  EXPECT_EQ(tracking.tracker.zeroState(), ZeroState::kTaken);
  RestPose pose = tracking.takeZero();
  EXPECT_NEAR(pose.noise, 2.0, 0.1);  // vibration is no noise of a pixel
}

TEST(Zero, IsRefusedWhereTooFewMarkersAreSeen) {
  Scene scene;
  Started tracking(scene);
  tracking.tracker.requestZero();
  const Frame& frame = scene.shoot();
  scene.smear(320.0, 240.0, 230.0, 0);
  tracking(frame);
  EXPECT_EQ(tracking.tracker.zeroState(), ZeroState::kTooFew);
  EXPECT_TRUE(tracking.field.flags & kFewMarkers);
}

// Whichever frame the still ones begin with.
TEST(Zero, AFirstStartTakesAsManyStillFramesAsAreNeededAndNoMore) {
  for (const int moving : {33, 41}) {
    Scene scene;
    Tracking tracking(scene);
    for (int i = 0; i < moving; ++i) {
      scene.displace(press(0.1 * i));
      tracking(scene.shoot());
    }
    int still = 0;
    while (still < 60 && tracking(scene.shoot()) == Outcome::kNoRestPose) ++still;
    EXPECT_LE(still, kZeroFrames + 9) << moving << ": the try that the motion ends takes ten frames";
  }
}

/// Brightness of the light `shots` pictures after it went on: a ramp of 25.
double warming(int shots, double from) {
  return from + (1.0 - from) * std::min(1.0, shots / 25.0);
}

// A zero of the ramp would be one of no light that comes again.
TEST(Zero, AFirstOneWaitsUntilTheLightIsSteadyAndNoLonger) {
  for (const double from : {0.2, 0.5, 0.8}) {
    Scene scene;
    Tracking tracking(scene);
    int shots = 0, unsteady = 0;
    while (shots < 100 && tracking(scene.shoot(false, warming(shots, from))) == Outcome::kNoRestPose) {
      if (tracking.tracker.zeroState() == ZeroState::kUnsteady) unsteady = shots;
      ++shots;
    }
    MarkerSight sight;
    EXPECT_TRUE(tracking.tracker.takeSight(sight));
    EXPECT_GT(sight.firstZero.brighter, 0.1F) << from;
    EXPECT_GT(unsteady, 10) << from;
    EXPECT_LE(shots, 25 + kZeroFrames + 10) << from << ": at most the try in which the ramp ends is given up";
    RestPose pose = tracking.takeZero();
    Scene steady;
    Started other(steady);
    RestPose right = other.takeZero();
    EXPECT_NEAR(pose.light, right.light, 0.02 * right.light) << from;
    shoot(scene, tracking, 10);
    EXPECT_EQ(tracking.field.validCount, scene.markers()) << from;
    EXPECT_NEAR(compare(scene, tracking.field).ratio, 1.0, 0.15) << from;
  }
}

TEST(Zero, ARequestedOneWaitsForTheLightWithinItsTimeAndIsThenRefused) {
  for (const bool ends : {true, false}) {
    Scene scene;
    Started tracking(scene);
    RestPose pose = tracking.takeZero();
    tracking.tracker.requestZero();
    int shots = 0;
    do {
      tracking(scene.shoot(false, ends ? 1.0 + 0.2 * warming(shots + 15, 0.0) : 1.0 + 0.008 * shots));
      ++shots;
    } while (tracking.tracker.zeroState() == ZeroState::kTaking && shots < 200);
    EXPECT_LE(shots, 2 * kZeroFrames);
    EXPECT_EQ(tracking.tracker.zeroState(), ends ? ZeroState::kTaken : ZeroState::kUnsteady);
    EXPECT_EQ(tracking.tracker.takeRestPose(pose), ends);
  }
}

TEST(Zero, FlickerIsNoTrendAndDelaysNone) {
  Scene scene;
  Tracking tracking(scene);
  int shots = 0;
  while (shots < 100 && tracking(scene.shoot(false, 1.0 + 0.05 * std::sin(2.1 * shots))) == Outcome::kNoRestPose) {
    ++shots;
  }
  EXPECT_LE(shots, kZeroFrames);
}

TEST(Zero, IsolatedGapsAreWrittenWithEachField) {
  Scene scene;
  scene.rest.col(100).setConstant(std::numeric_limits<double>::quiet_NaN());
  scene.rest.col(24 * 24 + 200).setConstant(std::numeric_limits<double>::quiet_NaN());
  scene.rest.col(0).setConstant(std::numeric_limits<double>::quiet_NaN());
  scene.now = scene.rest;
  Started tracking(scene);
  EXPECT_EQ(tracking.field.isolatedGaps, 2) << "not the corner";
}

TEST(Zero, MarkersThatWereMissingAreTakenInAtTheNext) {
  Scene scene;
  const Eigen::Matrix2Xd all = scene.rest;
  scene.remove(0.1, 9);
  Started tracking(scene);
  EXPECT_LT(tracking.field.validCount, scene.markers());
  scene.rest = scene.now = all;
  shoot(scene, tracking, 5);
  EXPECT_LT(tracking.field.validCount, scene.markers());
  tracking.tracker.requestZero();
  shoot(scene, tracking, kZeroFrames + 1);
  EXPECT_EQ(tracking.field.validCount, scene.markers());
  EXPECT_LT(compare(scene, tracking.field).rms_px, 0.025);
}

TEST(Zero, WhatWasTakenBackNeverComes) {
  // At any moment of its taking; whatever is then on the gel stays a load.
  std::mt19937 generator(test::seed());
  Scene scene;
  Started tracking(scene);
  RestPose pose = tracking.takeZero();
  const Id first = pose.id;
  for (int round = 0; round < 3; ++round) {
    scene.now = scene.rest;
    tracking.tracker.requestZero();
    shoot(scene, tracking, std::uniform_int_distribution(0, kZeroFrames - 1)(generator));
    EXPECT_TRUE(tracking.tracker.cancelZero());
    scene.displace(press(2.0));
    shoot(scene, tracking, kZeroFrames + 2);
    EXPECT_EQ(tracking.tracker.zeroState(), ZeroState::kNone);
    EXPECT_FALSE(tracking.tracker.takeRestPose(pose));
    EXPECT_EQ(tracking.field.zero, first);
    EXPECT_TRUE(tracking.field.flags & kZeroUnverified);
  }
  // Nor does a new request profit from the frames of the old one.
  scene.now = scene.rest;
  tracking.tracker.requestZero();
  shoot(scene, tracking, kZeroFrames - 1);
  ASSERT_TRUE(tracking.tracker.cancelZero());
  tracking.tracker.requestZero();
  shoot(scene, tracking, kZeroFrames - 1);
  EXPECT_EQ(tracking.tracker.zeroState(), ZeroState::kTaking);
  shoot(scene, tracking, 1);
  EXPECT_FALSE(tracking.tracker.cancelZero());  // too late
  EXPECT_TRUE(tracking.tracker.takeRestPose(pose));
  EXPECT_TRUE(pose.requested);
}

TEST(Zero, TakenBackAtTheFirstStartItIsTheFirstStarts) {
  Scene scene;
  Tracking tracking(scene);
  tracking.tracker.requestZero();
  shoot(scene, tracking, 10);
  EXPECT_TRUE(tracking.tracker.cancelZero());
  ASSERT_TRUE(tracking.start(scene, kZeroFrames + 2));
  RestPose pose = tracking.takeZero();
  EXPECT_FALSE(pose.requested);
  EXPECT_TRUE(tracking.field.flags & kZeroUnverified);
}

TEST(Zero, IsRefusedWhereMostPicturesAreTorn) {
  Scene scene;
  Started tracking(scene);
  tracking.tracker.requestZero();
  int frames = 0;
  for (; frames < 4 * kZeroFrames && tracking.tracker.zeroState() <= ZeroState::kTaking; ++frames) {
    const Frame& frame = scene.shoot();
    if (frames % 3 != 0) scene.shift(160 + 80 * (frames % 3), 3);
    tracking(frame);
  }
  EXPECT_EQ(tracking.tracker.zeroState(), ZeroState::kTorn);
  EXPECT_LE(frames, 2 * kZeroFrames + 1);
}

}  // namespace
}  // namespace tractiond::track::zero_test
