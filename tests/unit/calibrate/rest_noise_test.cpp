#include "daemon/calibrate/rest_noise.h"
#include "tests/unit/calibrate/markers.h"

#include <gtest/gtest.h>

namespace tractiond::calibrate::rest_noise_test {
namespace {

/// A zero with its own error, then frames with noise under a camera that shakes.
class Rest {
 public:
  Rest(const sensor::Sensor& sensor, const sensor::PictureMotion& shake, double noise_px, double promised_px)
      : fit_(sensor)
      , shake_(shake)
      , noise_px_(noise_px)
      , zero_(Seen(Eigen::Matrix2Xd::Zero(2, sensor.markerCount()), noise_px / std::sqrt(30.0), 1)) {
    field_.resize(sensor.markerCount());
    std::fill(field_.valid.begin(), field_.valid.end(), std::uint8_t{1});
    std::fill(field_.variance_px2.begin(), field_.variance_px2.end(), static_cast<float>(promised_px * promised_px));
    field_.validCount = sensor.markerCount();
  }

  MarkerField& next() {
    const Eigen::Vector4d motion(shake_.shift_px * normal_(generator_), shake_.shift_px * normal_(generator_),
                                 shake_.scale * normal_(generator_), shake_.roll * normal_(generator_));
    for (int i = 0; i < field_.validCount; ++i) {
      const Eigen::Vector2d common = fit_.at(i, motion);
      for (int c = 0; c < 2; ++c) {
        field_.displacement_px[2 * i + c] =
            static_cast<float>(common[c] + noise_px_ * normal_(generator_)) - zero_.value_px[2 * i + c];
      }
    }
    return field_;
  }

 private:
  PictureMotionFit fit_;
  sensor::PictureMotion shake_;
  double noise_px_;
  Seen zero_;
  MarkerField field_;
  std::mt19937 generator_{11};
  std::normal_distribution<double> normal_;
};

TEST(RestNoise, TellsMarkersFromThePicture) {
  const sensor::Sensor sensor;
  const sensor::PictureMotion shake{.shift_px = 0.03, .scale = 5e-5, .roll = 8e-5};
  Rest rest(sensor, shake, 0.016, 0.020);
  RestNoiseMeter meter(sensor);
  for (int frame = 0; frame < 300; ++frame) meter.add(rest.next());
  const RestNoise noise = meter.summary();
  EXPECT_EQ(noise.frames, 300);
  EXPECT_NEAR(noise.centre_px, 0.016, 0.0002);
  EXPECT_NEAR(noise.overPromised, 0.8, 0.01);
  EXPECT_NEAR(noise.motion.shift_px, shake.shift_px, 0.1 * shake.shift_px);
  EXPECT_NEAR(noise.motion.scale, shake.scale, 0.12 * shake.scale);
  EXPECT_NEAR(noise.motion.roll, shake.roll, 0.12 * shake.roll);
  EXPECT_FALSE(noise.bulge.found());
}

TEST(RestNoise, OfAStillPictureIsNotTheTrackersOwn) {
  const sensor::Sensor sensor;
  Rest rest(sensor, {.shift_px = 0.0, .scale = 0.0, .roll = 0.0}, 0.016, 0.016);
  RestNoiseMeter meter(sensor);
  for (int frame = 0; frame < 100; ++frame) meter.add(rest.next());
  const RestNoise noise = meter.summary();
  EXPECT_LE(noise.motion.shift_px, 2e-3);
  EXPECT_LE(noise.motion.scale, 5e-6);
  EXPECT_LE(noise.motion.roll, 5e-6);
}

TEST(RestNoise, NoticesATouch) {
  const sensor::Sensor sensor;
  Rest rest(sensor, {.shift_px = 0.01, .scale = 1e-5, .roll = 1e-5}, 0.016, 0.016);
  RestNoiseMeter meter(sensor);
  const sensor::Points markers = sensor::markerPositions(sensor.layers);
  for (int frame = 0; frame < 60; ++frame) {
    MarkerField& field = rest.next();
    for (Eigen::Index i = 0; i < markers.cols(); ++i) {
      field.displacement_px[2 * i] +=
          static_cast<float>(0.05 * std::exp(-markers.col(i).head<2>().squaredNorm() / (2 * 36e-6)));
    }
    meter.add(field);
  }
  EXPECT_TRUE(meter.summary().bulge.found());
}

}  // namespace
}  // namespace tractiond::calibrate::rest_noise_test
