#include "daemon/publish/wire_control.h"
#include "tests/unit/publish/support.h"
#include "traction/v1/control.pb.h"
#include "traction/v1/status.pb.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

namespace tractiond::publish::wire_control_test {
namespace {

namespace pb = traction::v1;

TEST(WireControl, StepsOfACalibrationAreTold) {
  using Kind = CalibrationStep::Kind;
  pb::Request request;
  request.set_version(1);
  CalibrationStep step;
  const auto decoded = [&]() -> tl::expected<Request, std::string> {
    return decodeRequest(request.SerializeAsString()).map([&](const Asked& asked) {
      step = asked.calibration;
      return asked.request;
    });
  };
  request.mutable_calibrate()->mutable_geometry()->set_anyway(true);
  EXPECT_EQ(decoded().value(), Request::kCalibrate);
  EXPECT_EQ(step.kind, Kind::kGeometry);
  EXPECT_TRUE(step.anyway);
  request.mutable_calibrate()->mutable_noise()->set_duration_s(7.0);
  EXPECT_EQ(decoded().value(), Request::kCalibrate);
  EXPECT_EQ(step.kind, Kind::kNoise);
  EXPECT_EQ(step.seconds, 7.0);
  EXPECT_FALSE(step.anyway);
  for (const double seconds : {-5.0, 1e300, std::numeric_limits<double>::quiet_NaN(), HUGE_VAL}) {
    request.mutable_calibrate()->mutable_noise()->set_duration_s(seconds);
    EXPECT_FALSE(decoded()) << seconds;
    request.mutable_calibrate()->mutable_weight()->set_patience_s(seconds);
    EXPECT_FALSE(decoded()) << seconds;
    request.mutable_calibrate()->mutable_creep()->set_duration_s(seconds);
    EXPECT_FALSE(decoded()) << seconds;
  }
  request.mutable_calibrate()->mutable_weight()->set_patience_s(0.0);
  request.mutable_calibrate()->mutable_weight()->set_weight_n(0.5);
  request.mutable_calibrate()->mutable_weight()->set_first(true);
  EXPECT_EQ(decoded().value(), Request::kCalibrate);
  EXPECT_EQ(step.kind, Kind::kWeight);
  EXPECT_EQ(step.weight_N, 0.5);
  EXPECT_TRUE(step.first);
  EXPECT_EQ(step.direction, (std::array{0.0, 0.0, 0.0}));
  pb::Vector3& direction = *request.mutable_calibrate()->mutable_weight()->mutable_direction();
  EXPECT_FALSE(decoded());
  direction.set_x(-0.5);
  direction.set_z(HUGE_VAL);
  EXPECT_FALSE(decoded());
  direction.set_z(2.0);
  EXPECT_EQ(decoded().value(), Request::kCalibrate);
  EXPECT_EQ(step.direction, (std::array{-0.5, 0.0, 2.0}));
  request.mutable_calibrate()->mutable_stiffness();
  EXPECT_EQ(decoded().value(), Request::kCalibrate);
  EXPECT_EQ(step.kind, Kind::kStiffness);
  request.mutable_calibrate()->mutable_creep()->set_duration_s(120.0);
  EXPECT_EQ(decoded().value(), Request::kCalibrate);
  EXPECT_EQ(step.kind, Kind::kCreep);
  EXPECT_EQ(step.seconds, 120.0);
  request.mutable_calibrate()->mutable_recovery();
  EXPECT_EQ(decoded().value(), Request::kCalibrate);
  EXPECT_EQ(step.kind, Kind::kRecovery);
  request.mutable_calibrate()->mutable_finish()->set_name("left");
  EXPECT_EQ(decoded().value(), Request::kCalibrate);
  EXPECT_EQ(step.kind, Kind::kFinish);
  EXPECT_EQ(step.name, "left");
  request.mutable_calibrate()->mutable_finish()->set_name("../left");
  EXPECT_FALSE(decoded());
  request.mutable_calibrate()->clear_step();
  EXPECT_FALSE(decoded());
}

TEST(WireControl, ImpossibleRequestsForTheCameraAreRefused) {
  pb::Request request;
  request.set_version(1);
  const auto refused = [&] {
    const auto asked = decodeRequest(request.SerializeAsString());
    return !asked && !asked.error().empty();
  };
  request.mutable_camera();
  EXPECT_TRUE(refused());
  for (const std::string& name :
       {std::string(), std::string("Exposure Time"), std::string("Gain\n"), std::string("Gain["), std::string("Gain[]"),
        std::string("Gain[Red]Blue"), std::string("[Red]"), std::string("Gain]"), std::string("Gain[[Red]]]"),
        std::string("../Gain"), std::string("Gain\0", 5), std::string(129, 'a')}) {
    request.mutable_camera()->mutable_read()->set_name(name);
    EXPECT_TRUE(refused()) << name;
    request.mutable_camera()->mutable_execute()->set_name(name);
    EXPECT_TRUE(refused()) << name;
    request.mutable_camera()->mutable_write()->set_name(name);
    EXPECT_TRUE(refused()) << name;
  }
  request.mutable_camera()->mutable_write()->set_name("Gain");
  EXPECT_FALSE(refused());
  for (const std::string& value : {std::string("1\n2"), std::string("\0", 1), std::string(1025, '1')}) {
    request.mutable_camera()->mutable_write()->set_value(value);
    EXPECT_TRUE(refused()) << value;
  }
  for (int i = 0; i < 65; ++i) request.mutable_camera()->mutable_list()->add_categories("Root");
  EXPECT_TRUE(refused());
  request.mutable_camera()->mutable_list()->clear_categories();
  EXPECT_FALSE(refused());
  request.mutable_camera()->mutable_list()->set_matching(std::string(129, 'a'));
  EXPECT_TRUE(refused());
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
  ASSERT_TRUE(reply.ParseFromString(encodeSnapshotReply(snapshot, sensor.layers)));
  const pb::SnapshotReply& told = reply.snapshot();
  EXPECT_EQ(told.reduced(), 2U);
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

TEST(WireControl, RepliesHoldWhatWasSent) {
  pb::Status sent;
  sent.mutable_header()->set_sequence(41);
  sent.mutable_ledger()->set_published(7);
  const std::string status = sent.SerializeAsString();
  pb::Reply reply;
  ASSERT_TRUE(reply.ParseFromString(encodeReply(Request::kStatus, status)));
  EXPECT_EQ(reply.version(), 1U);
  EXPECT_TRUE(reply.error().empty());
  EXPECT_EQ(reply.status().SerializeAsString(), status);

  ASSERT_TRUE(reply.ParseFromString(encodeZeroReply(restPose(), "touched")));
  EXPECT_EQ(reply.zero().zero().id(), text(idOf(50)));
  EXPECT_EQ(reply.zero().markers_present(), 1U);
  EXPECT_EQ(reply.zero().markers_expected(), 2U);
  EXPECT_EQ(reply.zero().noise_levels(), 2.5);
  EXPECT_EQ(reply.zero().remark(), "touched");

  const CalibrationReport report{
      .figures = {{"focal_px", 960.0, 2.0}}, .remarks = {"one"}, .path = "/gel.toml", .gelFile = "format = 1"};
  ASSERT_TRUE(reply.ParseFromString(encodeCalibrationReply(report)));
  EXPECT_EQ(reply.calibrate().figures(0).name(), "focal_px");
  EXPECT_EQ(reply.calibrate().figures(0).value(), 960.0);
  EXPECT_EQ(reply.calibrate().figures(0).deviation(), 2.0);
  EXPECT_EQ(reply.calibrate().remarks(0), "one");
  EXPECT_EQ(reply.calibrate().path(), "/gel.toml");
  EXPECT_EQ(reply.calibrate().gel_file(), "format = 1");

  ASSERT_TRUE(reply.ParseFromString(encodeAdoptReply()));
  EXPECT_EQ(reply.reply_case(), pb::Reply::kAdopt);

  ASSERT_TRUE(reply.ParseFromString(encodeErrorReply("no frames")));
  EXPECT_EQ(reply.error(), "no frames");
  EXPECT_EQ(reply.reply_case(), pb::Reply::REPLY_NOT_SET);
}

}  // namespace
}  // namespace tractiond::publish::wire_control_test
