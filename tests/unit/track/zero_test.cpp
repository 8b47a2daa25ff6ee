#include "daemon/track/rest_pose.h"
#include "tests/support/seed.h"
#include "tests/unit/track/scene.h"

#include <gtest/gtest.h>

namespace tractiond::track::zero_test {
namespace {

constexpr int kZeroFrames = 30;

void shoot(Scene& scene, Tracking& tracking, int frames) {
  for (int i = 0; i < frames; ++i) tracking(scene.shoot());
}

Bump press(double peak_px) {
  Bump bump;
  bump.peak_px = {peak_px, 0.0};
  return bump;
}

TEST(Zero, AFirstStartsIsUnverifiedAndARequestedOneIsVerified) {
  Scene scene;
  Tracking tracking(scene);
  ASSERT_TRUE(tracking.start(scene));
  RestPose first;
  ASSERT_TRUE(tracking.tracker.takeRestPose(first));
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
  RestPose second;
  ASSERT_TRUE(tracking.tracker.takeRestPose(second));
  EXPECT_FALSE(tracking.tracker.takeRestPose(second));
  EXPECT_TRUE(second.requested);
  EXPECT_NE(second.id, first.id);
  EXPECT_EQ(tracking.field.zero, second.id);
  EXPECT_NEAR(second.noise, 2.0, 0.1);
  EXPECT_NEAR(second.crossTalk[0], 0.2, 0.02);
  EXPECT_NEAR(second.crossTalk[1], 0.2, 0.02);
}

TEST(Zero, TheOldStaysInForceUntilTheNewIsComplete) {
  Scene scene;
  Tracking tracking(scene);
  ASSERT_TRUE(tracking.start(scene));
  scene.displace(press(4.0));
  shoot(scene, tracking, 1);
  const Id old = tracking.field.zero;
  tracking.tracker.requestZero();
  for (int i = 0; i < kZeroFrames; ++i) {
    shoot(scene, tracking, 1);
    EXPECT_EQ(tracking.field.zero, old);
    EXPECT_EQ(compare(scene, tracking.field).wrong, 0);
  }
  shoot(scene, tracking, 1);
  EXPECT_NE(tracking.field.zero, old);
  double largest = 0.0;
  for (const float displacement : tracking.field.displacement_px)
    largest = std::max(largest, std::abs(double{displacement}));
  EXPECT_LT(largest, 0.2);
}

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

TEST(Zero, ThatIsRefusedLeavesNothingBehind) {
  // What was learnt for it was learnt of a blurred picture.
  twin::Optics blurred;
  blurred.blur_px = 1.6;
  Scene scene, other;
  Tracking tracking(scene, awaitingGelCheck()), calm(other, awaitingGelCheck());
  RestPose refused;
  takeFittingZero(other, calm);
  const RestPose zero = takeFittingZero(scene, tracking);
  for (Scene* each : {&scene, &other}) each->change(blurred);
  tracking.tracker.requestZero();
  shoot(scene, tracking, kZeroFrames + 5);
  shoot(other, calm, kZeroFrames + 5);
  ASSERT_TRUE(tracking.tracker.takeRestPose(refused));
  ASSERT_TRUE(tracking.tracker.putInForce(zero, true));
  for (Scene* each : {&scene, &other}) each->change({});
  shoot(scene, tracking, 100);
  shoot(other, calm, 100);
  EXPECT_EQ(tracking.field.zero, zero.id);
  for (std::size_t i = 0; i < tracking.field.displacement_px.size(); ++i) {
    ASSERT_NEAR(tracking.field.displacement_px[i], calm.field.displacement_px[i], 1e-4);
  }
}

TEST(Zero, TheOneBeforeIsPutBackAsItWas) {
  Scene scene;
  Tracking tracking(scene);
  ASSERT_TRUE(tracking.start(scene));
  const auto zero = [&] {
    tracking.tracker.requestZero();
    shoot(scene, tracking, kZeroFrames + 1);
    RestPose pose;
    EXPECT_TRUE(tracking.tracker.takeRestPose(pose));
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

TEST(Zero, PutBackFromAnEarlierRunIsUnverifiedUntilThePictureAgrees) {
  Scene scene;
  Tracking first(scene), tracking(scene);
  ASSERT_TRUE(first.start(scene));
  first.tracker.requestZero();
  shoot(scene, first, kZeroFrames + 1);
  RestPose earlier;
  ASSERT_TRUE(first.tracker.takeRestPose(earlier));

  ASSERT_TRUE(tracking.start(scene));
  scene.displace(press(2.0));
  ASSERT_TRUE(tracking.tracker.putInForce(earlier, true));
  shoot(scene, tracking, 20);
  EXPECT_EQ(tracking.field.zero, earlier.id);
  EXPECT_TRUE(tracking.field.flags & kZeroUnverified);
  scene.now = scene.rest;
  shoot(scene, tracking, 15);
  EXPECT_FALSE(tracking.field.flags & kZeroUnverified);
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
    Tracking tracking(scene);
    ASSERT_TRUE(tracking.start(scene));
    RestPose pose;
    ASSERT_TRUE(tracking.tracker.takeRestPose(pose));
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
  Tracking tracking(scene);
  ASSERT_TRUE(tracking.start(scene));
  tracking.tracker.requestZero();
  for (int i = 0; i < kZeroFrames; ++i) {
    scene.displace([i](const Eigen::Vector2d&) { return Eigen::Vector2d(0.02 * std::sin(1.3 * i), 0.0); });
    shoot(scene, tracking, 1);
  }
  EXPECT_EQ(tracking.tracker.zeroState(), ZeroState::kTaken);
  RestPose pose;
  ASSERT_TRUE(tracking.tracker.takeRestPose(pose));
  EXPECT_NEAR(pose.noise, 2.0, 0.1);  // vibration is no noise of a pixel
}

TEST(Zero, IsRefusedWhereTooFewMarkersAreSeen) {
  Scene scene;
  Tracking tracking(scene);
  ASSERT_TRUE(tracking.start(scene));
  tracking.tracker.requestZero();
  const Frame& frame = scene.shoot();
  scene.smear(320.0, 240.0, 230.0, 0);
  tracking(frame);
  EXPECT_EQ(tracking.tracker.zeroState(), ZeroState::kTooFew);
  EXPECT_TRUE(tracking.field.flags & kFewMarkers);
}

TEST(Zero, AFirstStartWaitsForAStillGel) {
  Scene scene;
  Tracking tracking(scene);
  for (int i = 0; i < 45; ++i) {
    scene.displace(press(0.1 * i));
    EXPECT_EQ(tracking(scene.shoot()), Outcome::kNoRestPose);
  }
  EXPECT_EQ(tracking.tracker.zeroState(), ZeroState::kMoving);
  EXPECT_TRUE(tracking.start(scene, 2 * kZeroFrames + 1));
}

// Whichever frame the still ones begin with.
TEST(Zero, AFirstStartTakesAsManyStillFramesAsAreNeededAndNoMore) {
  for (const int moving : {33, 41, 50}) {
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

TEST(Zero, AFirstStartCountsTheStillFrames) {
  Scene scene;
  Tracking tracking(scene);
  MarkerSight sight;
  shoot(scene, tracking, 27);
  for (int i = 0; i < 100; ++i) {
    scene.displace(press(0.3 * (1 + i % 10)));
    tracking(scene.shoot());
  }
  ASSERT_TRUE(tracking.tracker.takeSight(sight));
  EXPECT_EQ(sight.firstZero.frames, 126) << "each frame is reported before it is averaged";
  EXPECT_NEAR(sight.firstZero.mostStill, 27, 1);
}

TEST(Zero, IsolatedGapsAreWrittenWithEachField) {
  Scene scene;
  scene.rest.col(100).setConstant(std::numeric_limits<double>::quiet_NaN());
  scene.rest.col(24 * 24 + 200).setConstant(std::numeric_limits<double>::quiet_NaN());
  scene.rest.col(0).setConstant(std::numeric_limits<double>::quiet_NaN());
  scene.now = scene.rest;
  Tracking tracking(scene);
  ASSERT_TRUE(tracking.start(scene));
  EXPECT_EQ(tracking.field.isolatedGaps, 2) << "not the corner";
}

TEST(Zero, MarkersThatWereMissingAreTakenInAtTheNext) {
  Scene scene;
  const Eigen::Matrix2Xd all = scene.rest;
  scene.remove(0.1, 9);
  Tracking tracking(scene);
  ASSERT_TRUE(tracking.start(scene));
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
  Tracking tracking(scene);
  ASSERT_TRUE(tracking.start(scene));
  RestPose pose;
  ASSERT_TRUE(tracking.tracker.takeRestPose(pose));
  const Id first = pose.id;
  for (int round = 0; round < 5; ++round) {
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
  RestPose pose;
  ASSERT_TRUE(tracking.tracker.takeRestPose(pose));
  EXPECT_FALSE(pose.requested);
  EXPECT_TRUE(tracking.field.flags & kZeroUnverified);
}

TEST(Zero, ThatNobodyRequestedCannotBeTakenBack) {
  Scene scene;
  Tracking tracking(scene);
  shoot(scene, tracking, 10);
  EXPECT_FALSE(tracking.tracker.cancelZero());
  ASSERT_TRUE(tracking.start(scene));
  RestPose pose;
  ASSERT_TRUE(tracking.tracker.takeRestPose(pose));
  EXPECT_FALSE(pose.requested);
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
  for (int round = 0; round < 4; ++round) {
    const twin::Optics before = drawn(), after = drawn();
    SCOPED_TRACE("blur " + std::to_string(before.blur_px) + " then " + std::to_string(after.blur_px));
    Scene scene(before), other(after);
    Tracking tracking(scene), fresh(other);
    ASSERT_TRUE(tracking.start(scene));
    ASSERT_TRUE(fresh.start(other));
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

TEST(Zero, ThatIsRefusedLeavesTheAppearanceAsItWas) {
  // What it learnt was learnt of a picture that somebody blurred for a moment.
  twin::Optics blurred;
  blurred.blur_px = 1.6;
  Scene scene, other;
  Tracking tracking(scene), calm(other);
  ASSERT_TRUE(tracking.start(scene));
  ASSERT_TRUE(calm.start(other));
  tracking.tracker.requestZero();
  for (int i = 0; i < kZeroFrames; ++i) {
    for (Scene* each : {&scene, &other}) {
      each->change(i == 0 ? blurred : twin::Optics{});
      each->displace(press(0.05 * i));
    }
    shoot(scene, tracking, 1);
    shoot(other, calm, 1);
  }
  ASSERT_GT(tracking.tracker.zeroState(), ZeroState::kTaken);
  scene.now = scene.rest;
  other.now = other.rest;
  shoot(scene, tracking, 100);  // what was known of the surroundings is forgotten meanwhile
  shoot(other, calm, 100);
  for (std::size_t i = 0; i < tracking.field.displacement_px.size(); ++i) {
    ASSERT_NEAR(tracking.field.displacement_px[i], calm.field.displacement_px[i], 1e-4);
  }
}

TEST(Zero, ThatIsPutBackHasItsAppearanceAgain) {
  // What was learnt for the zero that replaced it was learnt of a blurred picture.
  twin::Optics blurred;
  blurred.blur_px = 1.6;
  Scene scene, other;
  Tracking tracking(scene), calm(other);
  for (auto* each : {&tracking, &calm}) ASSERT_TRUE(each->start(each == &tracking ? scene : other));
  RestPose before;
  ASSERT_TRUE(tracking.tracker.takeRestPose(before));
  scene.change(blurred);
  other.change(blurred);
  tracking.tracker.requestZero();
  shoot(scene, tracking, kZeroFrames + 1);
  shoot(other, calm, kZeroFrames + 1);
  ASSERT_EQ(tracking.tracker.zeroState(), ZeroState::kTaken);
  ASSERT_NE(tracking.field.zero, before.id);
  ASSERT_TRUE(tracking.tracker.putInForce(before, true));
  scene.change({});
  other.change({});
  shoot(scene, tracking, 100);
  shoot(other, calm, 100);
  EXPECT_EQ(tracking.field.zero, before.id);
  for (std::size_t i = 0; i < tracking.field.displacement_px.size(); ++i) {
    ASSERT_NEAR(tracking.field.displacement_px[i], calm.field.displacement_px[i], 1e-4);
  }
}

TEST(Zero, IsRefusedWhereMostPicturesAreTorn) {
  Scene scene;
  Tracking tracking(scene);
  ASSERT_TRUE(tracking.start(scene));
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

RestPose restPose(Scene& scene, bool requested) {
  Tracking tracking(scene);
  EXPECT_TRUE(tracking.start(scene));
  if (requested) {
    tracking.tracker.requestZero();
    shoot(scene, tracking, kZeroFrames);
  }
  RestPose pose;
  EXPECT_TRUE(tracking.tracker.takeRestPose(pose));
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
}

TEST(RestoredZero, ThatNobodyRequestedStaysUnverified) {
  Scene scene;
  const RestPose pose = restPose(scene, false);
  Tracking tracking(scene);
  tracking.tracker.restore(pose);
  shoot(scene, tracking, 40);
  EXPECT_TRUE(tracking.field.flags & kZeroUnverified);
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
