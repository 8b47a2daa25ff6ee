#include "daemon/publish/wire.h"
#include "daemon/publish/wire_parts.h"
#include "tests/unit/publish/support.h"
#include "traction/v1/control.pb.h"
#include "traction/v1/description.pb.h"
#include "traction/v1/field.pb.h"
#include "traction/v1/markers.pb.h"
#include "traction/v1/status.pb.h"

#include <gtest/gtest.h>

namespace tractiond::publish::wire_test {
namespace {

namespace pb = traction::v1;

Heading heading() {
  Heading heading;
  heading.sequence = 41;
  heading.frame = frameInfo(70'000);
  heading.flags = kDiscontinuity | kFewMarkers;
  heading.zero = idOf(100);
  heading.sent_ns = 1'000'400'000;
  heading.sentReal_ns = 1'700'000'000'500'000'000;
  return heading;
}

void expectHeader(const pb::Header& header, const Heading& expected) {
  EXPECT_EQ(header.sequence(), expected.sequence);
  EXPECT_EQ(header.sensor(), "gel-1");
  EXPECT_EQ(header.boot(), text(idOf(10)));
  EXPECT_EQ(header.calibration(), text(idOf(20)));
  EXPECT_EQ(header.zero(), text(expected.zero));
  EXPECT_EQ(header.flags(), expected.flags);
  EXPECT_EQ(header.camera_frame_id(), expected.frame.cameraFrameId);
  EXPECT_EQ(header.frame_number(), expected.frame.frameNumber);
  EXPECT_EQ(header.device_time_ns(), expected.frame.times.device_ns);
  EXPECT_EQ(header.exposure_s(), expected.frame.exposure_s);
  EXPECT_EQ(header.received_real_ns(), expected.frame.times.receivedReal_ns);
  EXPECT_EQ(header.received_ns(), expected.frame.times.received_ns);
  EXPECT_EQ(header.captured_ns(), expected.frame.times.captured_ns);
  EXPECT_EQ(header.captured_error_ns(), expected.frame.times.capturedError_ns);
  EXPECT_EQ(header.captured_bound(), pb::CAPTURE_BOUND_BOTH);
  EXPECT_EQ(header.tracked_ns(), expected.frame.times.tracked_ns);
  EXPECT_EQ(header.solved_ns(), expected.frame.times.solved_ns);
  EXPECT_EQ(header.sent_ns(), expected.sent_ns);
}

TEST(Wire, FieldArrivesNumberByNumber) {
  Wire wire(description().identity);
  const TractionField field = traction(kMarkers, kNodes);
  pb::Field message;
  ASSERT_TRUE(message.ParseFromString(wire.fill(field, heading()).SerializeAsString()));
  expectHeader(message.header(), heading());
  EXPECT_DOUBLE_EQ(message.timestamp(), 1.7e9 + 1e-9);
  EXPECT_TRUE(message.valid());
  EXPECT_EQ(std::vector<float>(message.force_n().begin(), message.force_n().end()), field.force_N);
  EXPECT_EQ(message.node_valid(), std::string(kNodes, '\1'));
  EXPECT_EQ(message.resultant_n().x(), 1.0);
  EXPECT_EQ(message.resultant_n().y(), 2.0);
  EXPECT_EQ(message.resultant_n().z(), 3.0);
  EXPECT_EQ(message.moment_nm().x(), 4.0);
  EXPECT_EQ(message.moment_nm().y(), 5.0);
  EXPECT_EQ(message.moment_nm().z(), 6.0);
  EXPECT_EQ(message.centre_of_pressure_m().x(), 7.0);
  EXPECT_EQ(message.centre_of_pressure_m().y(), 8.0);
  EXPECT_TRUE(message.centre_of_pressure_valid());
  EXPECT_EQ(message.residual_px(), 9.0);
  EXPECT_EQ(message.valid_markers(), kMarkers - 1U);
}

TEST(Wire, CovariancesAreTheBlocksOfTheWrenchsRowAfterRow) {
  Wire wire(description().identity);
  pb::Field message;
  ASSERT_TRUE(message.ParseFromString(wire.fill(traction(kMarkers, kNodes), heading()).SerializeAsString()));
  const auto expectBlock = [](const pb::Covariance& block, std::vector<double> expected) {
    EXPECT_EQ(std::vector(block.noise().begin(), block.noise().end()), expected);
    for (double& number : expected) number += 100.0;
    EXPECT_EQ(std::vector(block.systematic().begin(), block.systematic().end()), expected);
  };
  const auto expectBlocks = [&](const pb::Covariance& force, const pb::Covariance& moment, const pb::Covariance& both) {
    expectBlock(force, {11, 12, 13, 21, 22, 23, 31, 32, 33});
    expectBlock(moment, {44, 45, 46, 54, 55, 56, 64, 65, 66});
    expectBlock(both, {14, 15, 16, 24, 25, 26, 34, 35, 36});
  };
  expectBlocks(message.resultant_covariance_n2(), message.moment_covariance_n2m2(),
               message.resultant_moment_covariance_n2m());
  for (const pb::Contact& contact : message.contacts()) {
    expectBlocks(contact.force_covariance_n2(), contact.moment_covariance_n2m2(),
                 contact.force_moment_covariance_n2m());
  }
}

TEST(Wire, ContactsAndHowTheForcesWereFoundArriveNumberByNumber) {
  Wire wire(description().identity);
  const TractionField field = traction(kMarkers, kNodes);
  pb::Field message;
  ASSERT_TRUE(message.ParseFromString(wire.fill(field, heading()).SerializeAsString()));
  EXPECT_EQ(std::vector<float>(message.node_deviation_n().begin(), message.node_deviation_n().end()),
            field.deviation_N);
  EXPECT_EQ(message.method(), pb::METHOD_CONTACT);
  EXPECT_EQ(message.picture_motion().shift_px().x(), 11.0);
  EXPECT_EQ(message.picture_motion().shift_px().y(), 12.0);
  EXPECT_EQ(message.picture_motion().scale(), 13.0);
  EXPECT_EQ(message.picture_motion().roll_rad(), 14.0);
  ASSERT_EQ(message.contacts_size(), 2);
  double expected = 0.0;
  for (const pb::Contact& contact : message.contacts()) {
    for (const double number : {contact.position_m().x(),
                                contact.position_m().y(),
                                contact.position_deviation_m().x(),
                                contact.position_deviation_m().y(),
                                contact.force_n().x(),
                                contact.force_n().y(),
                                contact.force_n().z(),
                                contact.force_deviation_n().x(),
                                contact.force_deviation_n().y(),
                                contact.force_deviation_n().z(),
                                contact.area_m2(),
                                contact.area_deviation_m2(),
                                contact.position_z_m(),
                                contact.moment_nm().x(),
                                contact.moment_nm().y(),
                                contact.moment_nm().z(),
                                contact.half_axes_m().x(),
                                contact.half_axes_m().y(),
                                contact.half_axes_deviation_m().x(),
                                contact.half_axes_deviation_m().y(),
                                contact.orientation_rad(),
                                contact.orientation_deviation_rad()}) {
      EXPECT_EQ(number, ++expected);
    }
  }
  EXPECT_EQ(message.contacts(0).hertz_radius_m(), 45.0);
  EXPECT_EQ(message.contacts(0).hertz_radius_deviation_m(), 46.0);
  EXPECT_EQ(message.contacts(1).hertz_radius_m(), 0.0);
}

TEST(Wire, InvalidFieldSaysSoAtEveryNodeAndNothingOfTheFieldBeforeIsLeft) {
  Wire wire(description().identity), unused(description().identity);
  wire.fill(traction(kMarkers, kNodes), heading());
  TractionField invalid;
  invalid.resize(kMarkers, kNodes);
  const std::string bytes = wire.fill(invalid, Heading{}).SerializeAsString();
  EXPECT_EQ(bytes, unused.fill(invalid, Heading{}).SerializeAsString());
  pb::Field message;
  ASSERT_TRUE(message.ParseFromString(bytes));
  EXPECT_FALSE(message.valid());
  EXPECT_EQ(message.node_valid(), std::string(kNodes, '\0'));
  EXPECT_EQ(message.force_n_size(), 3 * kNodes);
  EXPECT_FALSE(message.centre_of_pressure_valid());
  EXPECT_EQ(message.contacts_size(), 0);
  EXPECT_EQ(message.method(), pb::METHOD_NONE);
}

TEST(Wire, MarkersArriveNumberByNumber) {
  Wire wire(description().identity);
  const MarkerField markers = traction(kMarkers, kNodes).markers;
  pb::Markers message;
  ASSERT_TRUE(message.ParseFromString(wire.fill(markers, heading()).SerializeAsString()));
  expectHeader(message.header(), heading());
  EXPECT_DOUBLE_EQ(message.timestamp(), 1.7e9 + 1e-9);
  EXPECT_EQ(std::vector<float>(message.displacement_px().begin(), message.displacement_px().end()),
            markers.displacement_px);
  EXPECT_EQ(std::vector<float>(message.variance_px2().begin(), message.variance_px2().end()), markers.variance_px2);
  std::string valid(kMarkers, '\1');
  valid.back() = '\0';
  EXPECT_EQ(message.marker_valid(), valid);
  EXPECT_EQ(message.valid_markers(), kMarkers - 1U);
}

TEST(Wire, StatusHoldsTheWholeLedgerAndItsSum) {
  Wire wire(description().identity);
  Ledger ledger;
  std::uint64_t n = 0;
  for (Counter* loss : {&ledger.incomplete, &ledger.wrongSize, &ledger.wrongFormat, &ledger.stale, &ledger.implausible,
                        &ledger.evictedBeforeTrack, &ledger.noRestPose, &ledger.evictedBeforeSolve,
                        &ledger.evictedBeforePublish, &ledger.discardedAtStop, &ledger.noGel, &ledger.repeated}) {
    loss->add(++n);
  }
  ledger.published.add(1000);
  ledger.received.add(1000 + 78 + 3);
  ledger.missing.add(11);
  ledger.reconnects.add(12);
  ledger.doubted.add(13);
  ledger.invalid.add(14);
  wire.status().set_uptime_s(6.0);
  wire.status().set_camera(pb::CAMERA_STATE_STREAMING);

  pb::Status message;
  ASSERT_TRUE(message.ParseFromString(wire.fillStatus(ledger, heading()).SerializeAsString()));
  expectHeader(message.header(), heading());
  EXPECT_DOUBLE_EQ(message.timestamp(), 1'700'000'000.5);
  EXPECT_EQ(message.uptime_s(), 6.0);
  EXPECT_EQ(message.camera(), pb::CAMERA_STATE_STREAMING);
  const pb::Ledger& account = message.ledger();
  EXPECT_EQ(account.received(), 1081U);
  EXPECT_EQ(account.published(), 1000U);
  EXPECT_EQ(account.in_flight(), 3U);
  EXPECT_EQ(account.incomplete(), 1U);
  EXPECT_EQ(account.evicted_before_publish(), 9U);
  EXPECT_EQ(account.no_gel(), 11U);
  EXPECT_EQ(account.repeated(), 12U);
  EXPECT_EQ(account.missing(), 11U);
  EXPECT_EQ(account.reconnects(), 12U);
  EXPECT_EQ(account.doubted(), 13U);
  EXPECT_EQ(account.invalid(), 14U);
}

TEST(Wire, DescriptionArrivesNumberByNumber) {
  sensor::Sensor sensor;
  sensor.layers[0].colour = sensor::Colour::kGreen;
  sensor.layers[0].darker = true;
  sensor.gel.size = {0.1, 0.2, 0.03};
  sensor.camera.aspect = 1.035;
  sensor.camera.k1 = 0.01;
  sensor.camera.k2 = 0.02;
  sensor.camera.fisheye = true;
  sensor.camera.k3 = 0.03;
  sensor.camera.k4 = 0.04;
  sensor.camera.windowThickness = 0.005;
  sensor.camera.gelIndex = 1.41;
  sensor.camera.windowIndex = 1.49;
  sensor.camera.rotation = {0.1, 0.2, 0.3};
  sensor.camera.surfaces = {{{1e-3, 2e-3, 3e-3}, {4e-3, 5e-3, 6e-3}, 1.5}, {{0, 0, 20e-3}}};
  pb::Description message;
  describe(sensor, message);
  encode(restPose(), *message.mutable_zero());
  encode(description().identity, *message.mutable_header());
  encode(heading(), message);
  Heading expected = heading();
  expected.zero = idOf(50);  // of the rest pose it describes
  expectHeader(message.header(), expected);
  EXPECT_DOUBLE_EQ(message.timestamp(), 1'700'000'000.5);
  EXPECT_EQ(message.gel().youngs_modulus_pa(), 0.18e6);
  EXPECT_EQ(message.gel().poisson_ratio(), 0.49);
  EXPECT_EQ(message.gel().size_m().x(), 0.1);
  EXPECT_EQ(message.gel().size_m().y(), 0.2);
  EXPECT_EQ(message.gel().size_m().z(), 0.03);
  ASSERT_EQ(message.layers_size(), 2);
  EXPECT_EQ(message.layers(0).colour(), pb::COLOUR_GREEN);
  EXPECT_TRUE(message.layers(0).darker());
  const pb::MarkerLayer& red = message.layers(1);
  EXPECT_EQ(red.colour(), pb::COLOUR_RED);
  EXPECT_FALSE(red.darker());
  EXPECT_EQ(red.columns(), 24U);
  EXPECT_EQ(red.rows(), 24U);
  EXPECT_EQ(red.pitch_m(), 3e-3);
  EXPECT_EQ(red.depth_m(), 8e-3);
  EXPECT_EQ(red.centre_m().x(), 1.5e-3);
  EXPECT_EQ(red.centre_m().y(), 1.5e-3);
  EXPECT_EQ(red.diameter_m(), 0.6e-3);
  EXPECT_EQ(message.nodes().columns(), 24U);
  EXPECT_EQ(message.nodes().rows(), 24U);
  EXPECT_EQ(message.nodes().pitch_m(), 3e-3);
  EXPECT_EQ(message.nodes().centre_m().x(), 0.0);
  EXPECT_FALSE(message.has_body());
  const pb::Camera& camera = message.camera();
  EXPECT_EQ(camera.width_px(), 640U);
  EXPECT_EQ(camera.height_px(), 480U);
  EXPECT_EQ(camera.focal_px(), 960.0);
  EXPECT_EQ(camera.aspect(), 1.035);
  EXPECT_EQ(camera.principal_px().x(), 319.5);
  EXPECT_EQ(camera.principal_px().y(), 239.5);
  EXPECT_EQ(camera.k1(), 0.01);
  EXPECT_EQ(camera.k2(), 0.02);
  EXPECT_TRUE(camera.fisheye());
  EXPECT_EQ(camera.k3(), 0.03);
  EXPECT_EQ(camera.k4(), 0.04);
  EXPECT_EQ(camera.position_m().z(), 157e-3);
  EXPECT_EQ(camera.rotation_rad().z(), 0.3);
  EXPECT_EQ(camera.gel_index(), 1.41);
  EXPECT_EQ(camera.window_index(), 1.49);
  EXPECT_EQ(camera.window_thickness_m(), 0.005);
  ASSERT_EQ(camera.surfaces_size(), 2);
  EXPECT_EQ(camera.surfaces(0).centre_m().y(), 2e-3);
  EXPECT_EQ(camera.surfaces(0).radii_m().z(), 6e-3);
  EXPECT_EQ(camera.surfaces(0).index(), 1.5);
  EXPECT_EQ(camera.surfaces(1).radii_m().x(), 0.0);
  EXPECT_EQ(camera.surfaces(1).index(), 1.0);
  EXPECT_EQ(message.zero().id(), text(idOf(50)));
  EXPECT_EQ(message.zero().time_ns(), restPose().taken_ns);
  EXPECT_TRUE(message.zero().requested());
  EXPECT_EQ(message.zero().rest_position_px_size(), 4);
  EXPECT_EQ(message.zero().rest_position_px(3), 4.0F);
  EXPECT_EQ(message.zero().marker_present(), std::string("\1\0", 2));
}

}  // namespace
}  // namespace tractiond::publish::wire_test
