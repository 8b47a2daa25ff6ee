#include "tests/support/allocations.h"
#include "tests/unit/track/scene.h"

#include <gtest/gtest.h>

namespace tractiond::track::tracker_test {
namespace {

TEST(Tracker, AllocatesNothingButWhereItLearnsWhatMarkersLookLike) {
  for (const auto format : {twin::Format::kRgb8, twin::Format::kBayerGB8}) {
    Scene scene({}, format);
    scene.remove(0.05, 1);
    Tracking tracking(scene);
    tracking(scene.shoot());  // learns what markers look like
    std::uint64_t before = support::allocations();
    const auto zero = [&] {  // the first frame that is asked for a zero learns as well
      tracking.tracker.requestZero();
      EXPECT_EQ(support::allocations(), before);
      tracking(scene.shoot());
      before = support::allocations();
    };
    ASSERT_TRUE(tracking.start(scene));
    Bump bump;
    for (int i = 0; i < 60; ++i) {
      bump.peak_px = {0.5 * (i % 50), 0.1 * i};
      scene.displace(std::cref(bump));
      const Frame& frame = scene.shoot(i % 20 == 7);
      if (i % 10 > 6) scene.smear(200.0 + i, 240.0, 60.0, 0);
      if (i % 30 == 25) scene.smear(320.0, 240.0, 250.0, 0);
      tracking(frame);
      if (i == 30) zero();
    }
    scene.displace(std::cref(bump));
    for (int i = 0; i < 10; ++i) tracking(scene.shoot());
    zero();
    for (int i = 0; i < 35; ++i) tracking(scene.shoot());
    EXPECT_EQ(support::allocations(), before);
    EXPECT_EQ(tracking.tracker.zeroState(), ZeroState::kTaken);
  }
}

TEST(Tracker, SaysWhenTheMarkersAreTooFewToVerifyTheGelFile) {
  for (const int side : {5, 8}) {
    sensor::Sensor sensor;
    sensor.layers.resize(1);
    sensor.layers[0].columns = sensor.layers[0].rows = side;
    sensor.layers[0].pitch = 9e-3;
    Scene scene({}, twin::Format::kRgb8, sensor);
    Tracking tracking(scene);
    ASSERT_TRUE(tracking.start(scene));
    tracking(scene.shoot());
    EXPECT_EQ(tracking.field.validCount, side * side);
    EXPECT_EQ((tracking.field.flags & kGelUnverified) != 0, side * side < sensor::kVerifying);
    EXPECT_EQ(tracking.field.flags & kGelMismatch, 0U);
  }
}

TEST(Tracker, RowsMayBePadded) {
  Scene scene;
  Tracking tracking(scene);
  std::vector<std::uint8_t> padded(static_cast<std::size_t>(480 * 2048), 255);
  for (int i = 0; i < 32; ++i) {
    Frame frame = scene.shoot();
    for (int v = 0; v < 480; ++v) std::copy_n(frame.data + v * frame.stride, 1920, padded.begin() + v * 2048);
    frame.data = padded.data();
    frame.stride = 2048;
    frame.size = padded.size();
    tracking(frame);
  }
  EXPECT_EQ(tracking.field.validCount, scene.markers());
}

TEST(Tracker, LargerMarkersAndPicturesAreTracked) {
  sensor::Sensor sensor;
  sensor.camera.width = 1280;
  sensor.camera.height = 960;
  sensor.camera.focal_px = 1920.0;
  sensor.camera.principal_px = {639.5, 479.5};
  for (const auto format : {twin::Format::kRgb8, twin::Format::kBayerBG8}) {
    Scene scene({}, format, sensor);
    scene.remove(0.1, 2);
    Started tracking(scene);
    Bump bump;
    bump.centre = {640, 480};
    bump.width_px = 90.0;
    for (int i = 1; i <= 8; ++i) {
      bump.peak_px = {7.0 * i, 0.0};
      scene.displace(bump, 0.9);
      tracking(scene.shoot());
      const Comparison comparison = compare(scene, tracking.field);
      EXPECT_EQ(comparison.wrong, 0);
      EXPECT_GE(comparison.valid, 0.88 * scene.markers());
      EXPECT_LT(comparison.rms_px, 0.025);
    }
  }
}

}  // namespace
}  // namespace tractiond::track::tracker_test
