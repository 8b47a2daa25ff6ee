// Zeros that replace another: judged, put into force, put back, restored, and what is learnt for them.
#include "daemon/track/rest_pose.h"
#include "tests/support/seed.h"
#include "tests/unit/track/zero_bench.h"

#include <gtest/gtest.h>

namespace tractiond::track::zero_test {
namespace {

TrackOptions awaitingGelCheck() {
  return {.zeroFrames = kZeroFrames, .awaitsGelCheck = true};
}

/// Takes the first zero, which the gel file fits.
RestPose takeFittingZero(Scene& scene, Tracking& tracking) {
  RestPose zero;
  shoot(scene, tracking, kZeroFrames + 1);
  EXPECT_TRUE(tracking.tracker.takeRestPose(zero));
  tracking.tracker.setGelFits(zero.id, true);
  return zero;
}

TEST(Zero, ThatIsAskedForWaitsForItsDecisionWhileTheOneBeforeIsMeasuredFrom) {
  Scene scene;
  Tracking tracking(scene, awaitingGelCheck());
  shoot(scene, tracking, kZeroFrames + 1);
  RestPose first, second;
  ASSERT_TRUE(tracking.tracker.takeRestPose(first));
  EXPECT_EQ(tracking(scene.shoot()), Outcome::kNoRestPose);
  tracking.tracker.setGelFits(first.id, true);
  EXPECT_EQ(tracking(scene.shoot()), Outcome::kTracked);

  scene.displace(press(2.0));
  shoot(scene, tracking, 1);
  tracking.tracker.requestZero();
  shoot(scene, tracking, kZeroFrames);
  ASSERT_TRUE(tracking.tracker.takeRestPose(second));
  tracking.tracker.setGelFits(second.id, false);  // it is not in force yet
  for (int i = 0; i < 40; ++i) {
    ASSERT_EQ(tracking(scene.shoot()), Outcome::kTracked);
    ASSERT_EQ(tracking.field.zero, first.id);
    ASSERT_EQ(compare(scene, tracking.field).wrong, 0);
    ASSERT_TRUE(tracking.field.flags & kZeroUnverified);
    ASSERT_FALSE(tracking.field.flags & kGelMismatch);
  }
  ASSERT_TRUE(tracking.tracker.putInForce(second, true));
  EXPECT_EQ(tracking(scene.shoot()), Outcome::kTracked);  // no frame is lost over it
  EXPECT_EQ(tracking.field.zero, second.id);
  EXPECT_FALSE(tracking.field.flags & (kZeroUnverified | kGelMismatch));
  EXPECT_TRUE(tracking.tracker.inputs().adopted);

  ASSERT_TRUE(tracking.tracker.putInForce(first, false));
  EXPECT_EQ(tracking(scene.shoot()), Outcome::kTracked);
  EXPECT_EQ(tracking.field.zero, first.id);
  EXPECT_TRUE(tracking.field.flags & kZeroUnverified);
  EXPECT_TRUE(tracking.field.flags & kGelMismatch);
}

TEST(Zero, ThatIsBeingTakenChangesNoField) {
  // The candidate learns what markers look like in a blurred picture; the zero in force is followed as before.
  twin::Optics blurred;
  blurred.blur_px = 1.3;
  Scene scene, other;
  Tracking tracking(scene, awaitingGelCheck()), calm(other, awaitingGelCheck());
  takeFittingZero(other, calm);
  takeFittingZero(scene, tracking);
  for (Scene* each : {&scene, &other}) each->change(blurred);
  tracking.tracker.requestZero();
  for (int i = 0; i < kZeroFrames + 5; ++i) {
    shoot(scene, tracking, 1);
    shoot(other, calm, 1);
    ASSERT_EQ(tracking.field.displacement_px, calm.field.displacement_px) << "frame " << i;
    ASSERT_EQ(tracking.field.variance_px2, calm.field.variance_px2) << "frame " << i;
    ASSERT_EQ(tracking.field.flags, calm.field.flags) << "frame " << i;
  }
  EXPECT_EQ(tracking.tracker.zeroState(), ZeroState::kTaken);
}

TEST(Zero, TheOneBeforeIsPutBackAsItWas) {
  Scene scene;
  Started tracking(scene);
  const auto zero = [&] {
    tracking.tracker.requestZero();
    shoot(scene, tracking, kZeroFrames + 1);
    RestPose pose = tracking.takeZero();
    return pose;
  };
  const RestPose before = zero();
  scene.displace(press(4.0));
  const RestPose mistaken = zero();
  EXPECT_EQ(tracking.field.zero, mistaken.id);
  ASSERT_TRUE(tracking.tracker.putInForce(before, true));
  shoot(scene, tracking, 1);
  EXPECT_EQ(tracking.field.zero, before.id);
  EXPECT_FALSE(tracking.field.flags & kZeroUnverified);  // what it was before
  EXPECT_EQ(compare(scene, tracking.field).wrong, 0);    // by the true displacements from the first zero

  ASSERT_TRUE(tracking.tracker.putInForce(mistaken, true));
  shoot(scene, tracking, 1);
  EXPECT_EQ(tracking.field.zero, mistaken.id);
  EXPECT_FALSE(tracking.field.flags & kZeroUnverified);
}

TEST(Zero, LearnsAnewWhatMarkersLookLike) {
  // The lens has been refocused and its filter changed: as good as a tracker that has never seen anything else.
  std::mt19937 generator(test::seed());
  std::uniform_real_distribution<double> blur(0.6, 1.8), crossTalk(0.0, 0.4);
  const auto drawn = [&] {
    twin::Optics optics;
    optics.blur_px = blur(generator);
    optics.crossTalk = crossTalk(generator);
    return optics;
  };
  for (int round = 0; round < 2; ++round) {
    const twin::Optics before = drawn(), after = drawn();
    SCOPED_TRACE("blur " + std::to_string(before.blur_px) + " then " + std::to_string(after.blur_px));
    Scene scene(before), other(after);
    Started tracking(scene), fresh(other);
    scene.change(after);
    shoot(scene, tracking, 3);
    RestPose learnt, expected;
    ASSERT_TRUE(tracking.tracker.takeRestPose(learnt));
    tracking.tracker.requestZero();
    shoot(scene, tracking, kZeroFrames);
    ASSERT_EQ(tracking.tracker.zeroState(), ZeroState::kTaken) << describe(tracking.tracker.zeroState());
    ASSERT_TRUE(tracking.tracker.takeRestPose(learnt));
    ASSERT_TRUE(fresh.tracker.takeRestPose(expected));
    for (const int c : {0, 1}) EXPECT_NEAR(learnt.crossTalk[c], expected.crossTalk[c], 0.02);
    double ratio = 0.0;
    for (std::size_t i = 0; i < learnt.amplitude.size(); ++i) ratio += learnt.amplitude[i] / expected.amplitude[i];
    EXPECT_NEAR(ratio / static_cast<double>(learnt.amplitude.size()), 1.0, 0.01);
  }
}

RestPose restPose(Scene& scene, bool requested) {
  Tracking tracking(scene);
  EXPECT_TRUE(tracking.start(scene));
  if (requested) {
    tracking.tracker.requestZero();
    shoot(scene, tracking, kZeroFrames);
  }
  RestPose pose = tracking.takeZero();
  return pose;
}

TEST(RestoredZero, IsVerifiedByTheUnloadedPicture) {
  Scene scene;
  const RestPose pose = restPose(scene, true);
  Tracking tracking(scene);
  tracking.tracker.restore(pose);
  EXPECT_EQ(tracking(scene.shoot()), Outcome::kTracked);
  EXPECT_TRUE(tracking.field.flags & kZeroUnverified);
  shoot(scene, tracking, 15);
  EXPECT_FALSE(tracking.field.flags & kZeroUnverified);
  // Once seen it stays: a load does not make the zero doubtful.
  scene.displace(press(3.0));
  shoot(scene, tracking, 3);
  EXPECT_FALSE(tracking.field.flags & kZeroUnverified);
}

TEST(RestoredZero, StaysUnverifiedUnderLoadUntilItIsLetGo) {
  Scene scene;
  const RestPose pose = restPose(scene, true);
  scene.displace(press(2.0));
  Tracking tracking(scene);
  tracking.tracker.restore(pose);
  shoot(scene, tracking, 40);
  EXPECT_TRUE(tracking.field.flags & kZeroUnverified);
  EXPECT_EQ(compare(scene, tracking.field).wrong, 0);
  scene.now = scene.rest;
  shoot(scene, tracking, 15);
  EXPECT_FALSE(tracking.field.flags & kZeroUnverified);
  // One that nobody requested stays unverified.
  Tracking unasked(scene);
  unasked.tracker.restore(restPose(scene, false));
  shoot(scene, unasked, 40);
  EXPECT_TRUE(unasked.field.flags & kZeroUnverified);
}

TEST(RestoredZero, ThePictureMayHaveMovedByMoreThanHalfASpacing) {
  // The camera was nudged while the daemon was down: nothing is swapped, and the zero is not taken for verified.
  Scene scene;
  const RestPose pose = restPose(scene, true);
  scene.displace([](const Eigen::Vector2d&) { return Eigen::Vector2d(12.0, -4.0); });
  Tracking tracking(scene);
  tracking.tracker.restore(pose);
  shoot(scene, tracking, 20);
  const Comparison comparison = compare(scene, tracking.field);
  EXPECT_EQ(comparison.wrong, 0);
  EXPECT_GE(comparison.valid, scene.markers() - 30);
  EXPECT_TRUE(tracking.field.flags & kZeroUnverified);
}

}  // namespace
}  // namespace tractiond::track::zero_test
