// Displacements beyond the spacing, fast ones, gaps and things in the way: nothing may be taken for something else.
#include "tests/unit/track/scene.h"

#include <gtest/gtest.h>

namespace tractiond::track::motion_test {
namespace {

constexpr double kFastest_px = 7.0;    // per frame
constexpr double kFarthest_px = 29.0;  // 1.5 spacings

Bump bump(double peak_px) {
  Bump bump;
  bump.centre = {330.0, 228.0};
  bump.peak_px = peak_px * Eigen::Vector2d(0.8, 0.6);
  return bump;
}

/// Shoots and compares; returns how many are valid.
int expectNothingWrong(Scene& scene, Tracking& tracking, bool discontinuity = false) {
  EXPECT_EQ(tracking(scene.shoot(discontinuity)), Outcome::kTracked);
  const Comparison comparison = compare(scene, tracking.field);
  EXPECT_EQ(comparison.wrong, 0);
  return comparison.valid;
}

class Motion : public testing::TestWithParam<twin::Format> {};

TEST_P(Motion, FastAndFarSwapsNothingAndLosesFew) {
  Scene scene({}, GetParam());
  scene.remove(0.1, 4);
  Started tracking(scene);
  const int present = tracking.field.validCount;
  // From a standing start to the farthest, a stop, and back beyond rest.
  std::vector<double> peaks;
  for (double x = kFastest_px; x < kFarthest_px; x += kFastest_px) peaks.push_back(x);
  peaks.insert(peaks.end(), 3, kFarthest_px);
  for (double x = kFarthest_px; x > -kFarthest_px; x -= kFastest_px) peaks.push_back(x);
  peaks.push_back(-kFarthest_px);
  for (const double peak : peaks) {
    scene.displace(bump(peak), 0.8);
    EXPECT_GE(expectNothingWrong(scene, tracking), present - 12) << peak;
  }
}

TEST_P(Motion, RestartUnderLoadKeepsTheLoad) {
  Scene scene({}, GetParam());
  scene.remove(0.1, 5);
  RestPose pose;
  int present = 0;
  {
    Started before(scene);
    ASSERT_TRUE(before.tracker.takeRestPose(pose));
    present = before.field.validCount;
  }
  scene.displace(bump(kFarthest_px), 0.85);
  Tracking after(scene);
  after.tracker.restore(pose);
  EXPECT_GE(expectNothingWrong(scene, after), present - 12);
  EXPECT_TRUE(after.field.flags & kZeroUnverified);
  EXPECT_TRUE(after.field.flags & kReacquiring);
  EXPECT_EQ(after.field.zero, pose.id);
  EXPECT_GE(expectNothingWrong(scene, after), present - 12);
}

TEST_P(Motion, GapOfTenFramesIsFoundAgain) {
  Scene scene({}, GetParam());
  Started tracking(scene);
  for (const double peak : {kFarthest_px, 0.0, -kFarthest_px, 14.0}) {  // ten frames at 7 px could be anywhere
    scene.displace(bump(peak));
    EXPECT_GE(expectNothingWrong(scene, tracking, true), scene.markers() - 12) << peak;
    EXPECT_TRUE(tracking.field.flags & kReacquiring);
    EXPECT_GE(expectNothingWrong(scene, tracking), scene.markers() - 12) << peak;
    EXPECT_FALSE(tracking.field.flags & kReacquiring);
  }
}

TEST_P(Motion, GapThatNobodyToldOfSwapsNothing) {
  Scene scene({}, GetParam());
  Started tracking(scene);
  for (const double peak : {19.2, 0.0, kFarthest_px, -19.2}) {  // some land on their neighbours' old places
    scene.displace(bump(peak));
    expectNothingWrong(scene, tracking);
    for (int i = 0; i < 5; ++i) expectNothingWrong(scene, tracking);
    EXPECT_GE(expectNothingWrong(scene, tracking), scene.markers() - 12) << peak;
  }
}

TEST_P(Motion, APictureThatJumpsAsAWholeIsFoundAgain) {
  Scene scene({}, GetParam());
  Started tracking(scene);
  for (const Eigen::Vector2d& jump : {Eigen::Vector2d(7, 0), Eigen::Vector2d(0, -6), Eigen::Vector2d(0, 0)}) {
    scene.displace([&](const Eigen::Vector2d&) { return jump; });
    EXPECT_GE(expectNothingWrong(scene, tracking), scene.markers() - 60);
    EXPECT_GE(expectNothingWrong(scene, tracking), scene.markers() - 60);
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, Motion, testing::Values(twin::Format::kRgb8, twin::Format::kBayerRG8),
                         [](const auto& format) { return format.param == twin::Format::kRgb8 ? "Rgb8" : "Bayer"; });

TEST(Occlusion, BlueBehindRedIsNotBiased) {
  // Blue stands still, red wanders across it in half-pixel steps.
  for (const auto format : {twin::Format::kRgb8, twin::Format::kBayerRG8}) {
    twin::Optics optics;
    optics.readNoise = 1.0;
    Scene scene(optics, format);
    Started tracking(scene);
    double largest = 0.0;
    int hidden = 0;
    for (double step = 0.0; step <= 20.0; step += 0.5) {
      scene.displace([&](const Eigen::Vector2d&) { return Eigen::Vector2d(-0.7 * step, 0.7 * step); }, 0.0);
      expectNothingWrong(scene, tracking);
      for (int i = 0; i < scene.sensor.layers[0].count(); ++i) {
        if (!tracking.field.valid[i]) {
          ++hidden;
          continue;
        }
        const double error =
            std::hypot(tracking.field.displacement_px[2 * i], tracking.field.displacement_px[2 * i + 1]);
        largest = std::max(largest, error / std::sqrt(2.0 * tracking.field.variance_px2[i]));
      }
    }
    EXPECT_GT(hidden, 576);  // each for some steps
    EXPECT_LT(largest, 5.0);
    scene.now = scene.rest;
    tracking(scene.shoot(true));
    EXPECT_EQ(expectNothingWrong(scene, tracking), scene.markers());
  }
}

TEST(LostMarkers, AreReportedAndFoundAgain) {
  Scene scene;
  Started tracking(scene);
  // Something passes over the gel while it moves.
  for (int i = 0; i < 40; ++i) {
    scene.displace(bump(0.7 * i), 0.9);
    const Frame& frame = scene.shoot();
    const double u = 100.0 + 10.0 * i;
    scene.smear(u, 240.0, 40.0, 90);
    tracking(frame);
    EXPECT_EQ(compare(scene, tracking.field).wrong, 0) << i;
    for (int k = 0; k < scene.markers(); ++k) {
      const double distance = (scene.now.col(k) - Eigen::Vector2d(u, 240.0)).norm();
      EXPECT_FALSE(distance < 38.0 && tracking.field.valid[k]);
    }
    EXPECT_GE(tracking.field.validCount, scene.markers() - 70);
  }
  expectNothingWrong(scene, tracking);
  EXPECT_GE(expectNothingWrong(scene, tracking), scene.markers() - 6);
}

TEST(LostMarkers, DarkPicturesAreNotFollowed) {
  Scene scene;
  Started tracking(scene);
  const Eigen::Matrix2Xd rest = scene.rest;
  for (int i = 0; i < 10; ++i) {
    scene.now.setConstant(std::numeric_limits<double>::quiet_NaN());
    EXPECT_EQ(tracking(scene.shoot()), Outcome::kTracked);
    EXPECT_EQ(tracking.field.validCount, 0);
    EXPECT_TRUE(tracking.field.flags & kFewMarkers);
  }
  // Meanwhile the gel moved by a whole spacing in the middle.
  Bump far = bump(19.2);
  far.width_px = 70.0;
  scene.displace(far);
  int valid = 0;
  for (int i = 0; i < 12; ++i) valid = expectNothingWrong(scene, tracking);
  EXPECT_GE(valid, scene.markers() - 12);
  EXPECT_FALSE(tracking.field.flags & kFewMarkers);
}

TEST(LostMarkers, AreZeroWhereInvalid) {
  Scene scene;
  Started tracking(scene);
  const Frame& frame = scene.shoot();
  scene.smear(300.0, 200.0, 60.0, 0);
  tracking(frame);
  int invalid = 0;
  for (int i = 0; i < scene.markers(); ++i) {
    if (tracking.field.valid[i]) {
      EXPECT_GT(tracking.field.variance_px2[i], 0.0F);
      continue;
    }
    ++invalid;
    EXPECT_EQ(tracking.field.displacement_px[2 * i], 0.0F);
    EXPECT_EQ(tracking.field.displacement_px[2 * i + 1], 0.0F);
    EXPECT_EQ(tracking.field.variance_px2[i], 0.0F);
  }
  EXPECT_EQ(invalid, scene.markers() - tracking.field.validCount);
  EXPECT_GT(invalid, 20);
}

}  // namespace
}  // namespace tractiond::track::motion_test
