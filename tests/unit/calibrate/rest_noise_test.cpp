#include "daemon/calibrate/rest_noise.h"
#include "tests/unit/calibrate/frames.h"

#include <gtest/gtest.h>

namespace tractiond::calibrate::rest_noise_test {
namespace {

/// What is seen of a zero with its own error in frames under a camera that shakes.
RestNoise measured(const sensor::PictureMotion& shake, int count, double promised_px) {
  const sensor::Sensor sensor = coarse();
  const PictureMotionFit fit(sensor);
  std::mt19937 generator(11);
  std::normal_distribution<double> normal;
  const Eigen::VectorXd zero = Eigen::VectorXd::NullaryExpr(
      2 * sensor.markerCount(), [&] { return kNoise_px / std::sqrt(30.0) * normal(generator); });
  Frames frames(sensor);
  std::ranges::fill(frames.field().variance_px2, static_cast<float>(promised_px * promised_px));
  RestNoiseMeter meter(sensor);
  for (int frame = 0; frame < count; ++frame) {
    const Eigen::Vector4d motion(shake.shift_px * normal(generator), shake.shift_px * normal(generator),
                                 shake.scale * normal(generator), shake.roll * normal(generator));
    Eigen::VectorXd moved = -zero;
    for (int i = 0; i < sensor.markerCount(); ++i) moved.segment<2>(2 * i) += fit.at(i, motion);
    meter.add(frames.next(moved));
  }
  return meter.summary();
}

TEST(RestNoise, TellsMarkersFromThePicture) {
  const sensor::PictureMotion shake{.shift_px = 0.03, .scale = 5e-5, .roll = 8e-5};
  const RestNoise noise = measured(shake, 300, 0.020);
  EXPECT_EQ(noise.frames, 300);
  EXPECT_NEAR(noise.centre_px, kNoise_px, 0.0002);
  EXPECT_NEAR(noise.overPromised, 0.8, 0.01);
  EXPECT_NEAR(noise.motion.shift_px, shake.shift_px, 0.1 * shake.shift_px);
  EXPECT_NEAR(noise.motion.scale, shake.scale, 0.12 * shake.scale);
  EXPECT_NEAR(noise.motion.roll, shake.roll, 0.12 * shake.roll);
  EXPECT_FALSE(noise.bulge.found());
}

TEST(RestNoise, OfAStillPictureIsNotTheTrackersOwn) {
  const RestNoise noise = measured({.shift_px = 0.0, .scale = 0.0, .roll = 0.0}, 100, kNoise_px);
  EXPECT_LE(noise.motion.shift_px, 2e-3);
  EXPECT_LE(noise.motion.scale, 5e-6);
  EXPECT_LE(noise.motion.roll, 5e-6);
}

}  // namespace
}  // namespace tractiond::calibrate::rest_noise_test
