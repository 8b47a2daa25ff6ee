#include "daemon/publish/wire_control.h"
#include "tests/unit/publish/support.h"
#include "traction/v1/control.pb.h"
#include "traction/v1/status.pb.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <optional>

namespace tractiond::publish::wire_control_test {
namespace {

namespace pb = traction::v1;

/// Returns the step that a request is read as; none where it is refused.
std::optional<CalibrationStep> stepOf(const pb::CalibrateRequest& calibrate) {
  pb::Request request;
  request.set_version(1);
  *request.mutable_calibrate() = calibrate;
  const auto asked = decodeRequest(request.SerializeAsString());
  if (!asked) return std::nullopt;
  EXPECT_EQ(asked->request, Request::kCalibrate);
  return asked->calibration;
}

TEST(WireControl, StepsOfACalibrationAreTold) {
  using Kind = CalibrationStep::Kind;
  pb::CalibrateRequest calibrate;
  EXPECT_FALSE(stepOf(calibrate));
  calibrate.mutable_geometry()->set_anyway(true);
  EXPECT_EQ(stepOf(calibrate)->kind, Kind::kGeometry);
  EXPECT_TRUE(stepOf(calibrate)->anyway);
  calibrate.mutable_noise()->set_duration_s(7.0);
  EXPECT_EQ(stepOf(calibrate)->kind, Kind::kNoise);
  EXPECT_EQ(stepOf(calibrate)->seconds, 7.0);
  EXPECT_FALSE(stepOf(calibrate)->anyway);
  calibrate.mutable_creep()->set_duration_s(120.0);
  EXPECT_EQ(stepOf(calibrate)->kind, Kind::kCreep);
  EXPECT_EQ(stepOf(calibrate)->seconds, 120.0);
  calibrate.mutable_stiffness();
  EXPECT_EQ(stepOf(calibrate)->kind, Kind::kStiffness);
  calibrate.mutable_recovery();
  EXPECT_EQ(stepOf(calibrate)->kind, Kind::kRecovery);
  calibrate.mutable_finish()->set_name("left");
  EXPECT_EQ(stepOf(calibrate)->kind, Kind::kFinish);
  EXPECT_EQ(stepOf(calibrate)->name, "left");
  pb::CalibrateWeight& weight = *calibrate.mutable_weight();
  weight.set_weight_n(0.5);
  weight.set_first(true);
  EXPECT_EQ(stepOf(calibrate)->kind, Kind::kWeight);
  EXPECT_EQ(stepOf(calibrate)->weight_N, 0.5);
  EXPECT_TRUE(stepOf(calibrate)->first);
  EXPECT_EQ(stepOf(calibrate)->direction, (std::array{0.0, 0.0, 0.0}));
  weight.mutable_direction()->set_x(-0.5);
  weight.mutable_direction()->set_z(2.0);
  EXPECT_EQ(stepOf(calibrate)->direction, (std::array{-0.5, 0.0, 2.0}));
}

TEST(WireControl, ImpossibleStepsOfACalibrationAreRefused) {
  pb::CalibrateRequest calibrate;
  for (const double seconds : {-5.0, 1e300, std::numeric_limits<double>::quiet_NaN(), HUGE_VAL}) {
    calibrate.mutable_noise()->set_duration_s(seconds);
    EXPECT_FALSE(stepOf(calibrate)) << seconds;
    calibrate.mutable_weight()->set_patience_s(seconds);
    EXPECT_FALSE(stepOf(calibrate)) << seconds;
    calibrate.mutable_creep()->set_duration_s(seconds);
    EXPECT_FALSE(stepOf(calibrate)) << seconds;
  }
  pb::Vector3& direction = *calibrate.mutable_weight()->mutable_direction();
  EXPECT_FALSE(stepOf(calibrate));
  direction.set_z(HUGE_VAL);
  EXPECT_FALSE(stepOf(calibrate));
  calibrate.mutable_finish()->set_name("../left");
  EXPECT_FALSE(stepOf(calibrate));
}

TEST(WireControl, ARequestForTheCameraWithoutAStepIsRefused) {
  pb::Request request;
  request.set_version(1);
  request.mutable_camera();
  EXPECT_FALSE(decodeRequest(request.SerializeAsString()));
  request.mutable_camera()->mutable_write()->set_name("Gain");
  EXPECT_TRUE(decodeRequest(request.SerializeAsString()));
}

TEST(WireControl, ASnapshotHasThePictureAndItsMarkers) {
  Snapshot snapshot;
  const sensor::Sensor sensor;
  const auto count = static_cast<std::size_t>(sensor.markerCount());
  snapshot.bytes.assign(8000 * 6000, 7);  // more than is sent
  snapshot.frame.data = snapshot.bytes.data();
  snapshot.frame.size = snapshot.bytes.size();
  snapshot.frame.width = snapshot.frame.stride = 8000;
  snapshot.frame.height = 6000;
  snapshot.frame.format = PixelFormat::kMono8;
  snapshot.place_px.assign(2 * count, 5.5F);
  snapshot.state.assign(count, MarkerState::kLost);
  snapshot.spot_px = {1.0F, 2.0F};
  snapshot.spotLayer = {1};
  pb::Reply reply;
  ASSERT_TRUE(reply.ParseFromString(encodeSnapshotReply(snapshot, sensor.layers, {"Vendor-1", "8000 x 6000 px"})));
  const pb::SnapshotReply& told = reply.snapshot();
  EXPECT_EQ(told.reduced(), 2U);
  EXPECT_EQ(told.measured_with(), "Vendor-1 (8000 x 6000 px, reduced by 2)");
  EXPECT_EQ(told.width(), 4000U);
  EXPECT_EQ(told.levels().size(), 4000U * 3000U);
  EXPECT_EQ(told.levels().back(), 7);
  EXPECT_EQ(told.pixel_format(), "Mono8");
  ASSERT_EQ(told.marker_state().size(), count);
  EXPECT_EQ(told.marker_state()[0], pb::MARKER_STATE_LOST);
  EXPECT_EQ(told.marker_layer()[575], 0);
  EXPECT_EQ(told.marker_layer()[576], 1);
  EXPECT_EQ(told.colours(1), pb::COLOUR_RED);
  EXPECT_EQ(told.place_px_size(), static_cast<int>(2 * count));
  EXPECT_EQ(told.spot_px(1), 2.0F);
  EXPECT_EQ(told.spot_layer()[0], 1);
}

}  // namespace
}  // namespace tractiond::publish::wire_control_test
