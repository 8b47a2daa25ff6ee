#include "daemon/calibrate/picture_motion.h"
#include "tests/unit/calibrate/markers.h"

#include <gtest/gtest.h>

namespace tractiond::calibrate::picture_motion_test {
namespace {

Eigen::Matrix2Xd displaced(const PictureMotionFit& fit, const Eigen::Vector4d& motion, int markers) {
  Eigen::Matrix2Xd pixels(2, markers);
  for (int i = 0; i < markers; ++i) pixels.col(i) = fit.at(i, motion);
  return pixels;
}

TEST(PictureMotion, IsFoundWithinItsDeviation) {
  const sensor::Sensor sensor;
  const PictureMotionFit fit(sensor);
  const Eigen::Vector4d motion(0.05, -0.03, 2e-4, -1e-4);
  Eigen::Vector4d square = Eigen::Vector4d::Zero();
  constexpr int kTrials = 200;
  for (unsigned trial = 0; trial < kTrials; ++trial) {
    const auto found = fit(Seen(displaced(fit, motion, sensor.markerCount()), 0.016, trial));
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->rms_px, 0.016, 0.002);
    square += (found->value - motion).cwiseAbs2().cwiseQuotient(found->covariance.diagonal());
  }
  for (const double one : (square / kTrials).cwiseSqrt()) EXPECT_NEAR(one, 1.0, 0.15);
}

TEST(PictureMotion, RollTurnsUTowardsV) {
  const sensor::Sensor sensor;
  const PictureMotionFit fit(sensor);
  // The last marker of a layer is at the upper right: u > 0, v < 0 from the principal point.
  const Eigen::Vector2d moved = fit.at(sensor.layers[0].count() - 1, {0.0, 0.0, 0.0, 1e-3});
  EXPECT_GT(moved.x(), 0.0);
  EXPECT_GT(moved.y(), 0.0);
}

TEST(PictureMotion, NeedsMarkers) {
  const sensor::Sensor sensor;
  const PictureMotionFit fit(sensor);
  Seen seen(Eigen::Matrix2Xd::Zero(2, sensor.markerCount()), 0.01, 1);
  std::fill(seen.valid.begin() + 9, seen.valid.end(), std::uint8_t{0});
  EXPECT_FALSE(fit(seen));
}

TEST(Bulge, IsNotFoundInNoiseNorInMisplacedMarkers) {
  const sensor::Sensor sensor;
  for (unsigned seed = 0; seed < 50; ++seed) {
    Seen seen(Eigen::Matrix2Xd::Zero(2, sensor.markerCount()), 0.016, seed);
    for (std::size_t i = seed; i < seen.valid.size(); i += 41) seen.value_px[2 * i] += 0.5F;
    const Bulge bulge = largestBulge(sensor, seen, 0.0);
    EXPECT_FALSE(bulge.found()) << bulge.size_px << " of " << bulge.limit_px;
  }
}

TEST(Bulge, IsFoundWhereNeighboursAgree) {
  const sensor::Sensor sensor;
  const Eigen::Vector2d centre(-12e-3, 6e-3);
  const sensor::Points markers = sensor::markerPositions(sensor.layers);
  Eigen::Matrix2Xd pixels = Eigen::Matrix2Xd::Zero(2, markers.cols());
  for (Eigen::Index i = 0; i < markers.cols(); ++i) {
    pixels(0, i) = 0.06 * std::exp(-(markers.col(i).head<2>() - centre).squaredNorm() / (2 * 36e-6));
  }
  const Bulge bulge = largestBulge(sensor, Seen(pixels, 0.016, 1), 0.0);
  EXPECT_TRUE(bulge.found());
  EXPECT_LT((bulge.place - centre).norm(), 6e-3);
}

}  // namespace
}  // namespace tractiond::calibrate::picture_motion_test
