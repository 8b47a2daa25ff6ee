#include "daemon/calibrate/zero_tracking.h"
#include "tests/unit/calibrate/frames.h"

#include <gtest/gtest.h>

#include <random>

namespace tractiond::calibrate {
namespace {

/// A gel that is watched, and what is left of the displacements of a marker at the edge and of one under the press.
class ZeroTrackingTest : public testing::Test {
 protected:
  /// Shows frames for some seconds; the last is in seen_.
  void show(double seconds, double press_px, const Eigen::Vector4d& motion = Eigen::Vector4d::Zero()) {
    for (int i = 0; i < std::lround(seconds * kRate_Hz); ++i) {
      seen_ = frames_.next(press_px, motion);
      tracking_.takeOff(seen_);
      tracking_.watch(seen_);
    }
  }

  /// Root mean square of what is left for the forces.
  double left_px() const {
    double squares = 0.0;
    for (const float each : seen_.elastic_px) squares += double{each} * double{each};
    return std::sqrt(squares / static_cast<double>(seen_.elastic_px.size()));
  }

  sensor::Sensor sensor_ = coarse();
  ZeroTracking tracking_{sensor_};
  Frames frames_{sensor_};
  MarkerField seen_;
};

TEST_F(ZeroTrackingTest, TakesOffWhatMovesTheUntouchedPictureAndWarnsOfIt) {
  const Eigen::Vector4d away(0.3, -0.1, 2e-4, 1e-4);
  DriftWarning warning;
  show(10, 0.0);
  EXPECT_FALSE(warning.take(sensor_, seen_));
  show(120, 0.0, away);
  EXPECT_NEAR(seen_.drift.shiftU_px, away[0], 0.003);
  EXPECT_NEAR(seen_.drift.shiftV_px, away[1], 0.003);
  EXPECT_NEAR(seen_.drift.scale, away[2], 1e-5);
  EXPECT_NEAR(seen_.drift.roll, away[3], 1e-5);
  EXPECT_LT(seen_.drift.rms_px, 0.005);
  EXPECT_NEAR(left_px(), kNoise_px, 0.1 * kNoise_px);
  EXPECT_TRUE(warning.take(sensor_, seen_));
  EXPECT_FALSE(warning.take(sensor_, seen_));  // once is enough
  // A new zero is a new beginning.
  frames_.field().zero[0] = 2;
  show(0.1, 0.0);
  EXPECT_EQ(seen_.drift.seen_ns, 0);
  EXPECT_NEAR(left_px(), kNoise_px, 0.1 * kNoise_px);
}

TEST_F(ZeroTrackingTest, KeepsALightTouchThatStays) {
  show(10, 0.0);
  const RestDrift before = seen_.drift;
  for (const double press_px : {1.0, 0.04}) {
    show(1, press_px);
    const double first_px = left_px();
    show(press_px < 1.0 ? 900 : 60, press_px);
    EXPECT_NEAR(left_px(), first_px, 0.05 * first_px) << press_px;
    EXPECT_EQ(seen_.drift.seen_ns, before.seen_ns) << press_px;
  }
}

TEST(ZeroTracking, TakesNoPressForDriftWhateverTheCycle) {
  // Few markers, a pad that moves in its mount with the load, and presses now here, now there.
  constexpr double kPeak_px = 2.0, kWidth = 6e-3;
  sensor::Sensor sensor = coarse();
  sensor.layers.resize(1);
  sensor.layers[0].columns = 9;
  sensor.layers[0].rows = 7;
  const sensor::Points markers = sensor::markerPositions(sensor.layers);
  const PictureMotionFit mount(sensor);
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> draw(-1.0, 1.0);
  const auto press = [&] {
    const Eigen::Vector2d place(18e-3 * draw(generator), 12e-3 * draw(generator));
    const Eigen::Vector4d moved(draw(generator), draw(generator), 5e-3 * draw(generator), 2e-3 * draw(generator));
    Eigen::Matrix2Xd all = markers.topRows<2>().colwise() - place;
    for (Eigen::Index i = 0; i < all.cols(); ++i) {
      all.col(i) *= kPeak_px / kWidth * std::exp(-all.col(i).squaredNorm() / (2 * kWidth * kWidth));
      all.col(i) += mount.at(static_cast<int>(i), moved);
    }
    return Eigen::VectorXd(all.reshaped());
  };
  ZeroTracking tracking(sensor);
  Frames frames(sensor);
  MarkerField seen;
  const auto show = [&](const Eigen::VectorXd& moved_px, int count) {
    for (int i = 0; i < count; ++i) {
      seen = frames.next(moved_px);
      tracking.takeOff(seen);
      tracking.watch(seen);
    }
  };
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(2 * markers.cols());
  show(rest, 600);
  const RestDrift before = seen.drift;
  for (const int pressed : {4, 12, 60}) {
    for (int cycle = 0; cycle < 3600 / pressed; ++cycle) {
      show(press(), pressed);
      show(rest, pressed / 2);
    }
    EXPECT_EQ(seen.drift.seen_ns, before.seen_ns) << pressed;
  }
}

TEST_F(ZeroTrackingTest, FollowsAPictureThatVibrates) {
  std::mt19937_64 generator(1);
  std::normal_distribution<double> shift(0.0, 0.2);
  for (int i = 0; i < 3600; ++i) show(1.0 / kRate_Hz, 0.0, {0.3 + shift(generator), shift(generator), 0.0, 0.0});
  EXPECT_NEAR(seen_.drift.shiftU_px, 0.3, 0.05);
}

TEST_F(ZeroTrackingTest, SaysHowWarmTheGelMayBe) {
  const auto far = 1e-3 * ZeroTracking::kHeat_K_per_s;
  show(10, 0.0);
  EXPECT_LE(seen_.heatDeviation_K, ZeroTracking::kHeat_K_per_s * ZeroTracking::kWindow_s);
  show(60, 1.0);
  EXPECT_NEAR(seen_.heatDeviation_K, ZeroTracking::kHeat_K_per_s * 62, ZeroTracking::kHeat_K_per_s * 3);
  // What the camera says only adds to it, however large.
  FrameExtras& extras = frames_.field().info.extras;
  extras.temperature_C = 30.0F;
  extras.hasTemperature = true;
  show(10, 0.0);
  extras.temperature_C = 33.0F;
  show(1, 1.0);
  EXPECT_NEAR(seen_.heatDeviation_K, 3.0, 0.01);
  extras.temperature_C = -1e9F;
  show(1, 1.0);
  EXPECT_FLOAT_EQ(seen_.heatDeviation_K, static_cast<float>(ZeroTracking::kMost_K));
  extras.hasTemperature = false;
  show(1, 1.0);
  EXPECT_LT(seen_.heatDeviation_K, ZeroTracking::kHeat_K_per_s * 7 + far);
}

TEST_F(ZeroTrackingTest, DoesNotKnowHowWarmTheZeroOfAnEarlierRunIsUntilNothingTouches) {
  frames_.field().info.times.receivedReal_ns = 10'000'000'000'000;
  tracking_.resume(1);
  show(20, 1.0);
  EXPECT_NEAR(seen_.heatDeviation_K, ZeroTracking::kResumed_K, 0.06);
  show(10, 0.0, {0.2, 0.0, 1e-3, 0.0});
  EXPECT_LT(seen_.heatDeviation_K, 0.05);
  EXPECT_NEAR(left_px(), kNoise_px, 0.1 * kNoise_px);
}

TEST_F(ZeroTrackingTest, OnlyMeasuresIfItIsNotToFollow) {
  ZeroTracking measures(sensor_, false);
  for (int i = 0; i < 7200; ++i) {
    seen_ = frames_.next(0.0, {0.3, 0.0, 0.0, 0.0});
    measures.takeOff(seen_);
    measures.watch(seen_);
  }
  EXPECT_EQ(seen_.elastic_px, seen_.displacement_px);
  EXPECT_NEAR(seen_.drift.shiftU_px, 0.3, 0.003);
  EXPECT_FALSE(seen_.drift.isFollowed);
  EXPECT_EQ(seen_.heatDeviation_K, 0.0F);
}

}  // namespace
}  // namespace tractiond::calibrate
