// What the daemon's publisher sends arrives at the client library, number by number.
#include "tests/unit/client/subscriber_bench.h"

namespace traction::subscriber_test {
namespace {

void expectHeader(const Header& header) {
  EXPECT_GT(header.sequence, 0U);
  EXPECT_EQ(header.sensor, "gel-1");
  EXPECT_EQ(header.boot, idOf(10));
  EXPECT_EQ(header.calibration, idOf(20));
  EXPECT_EQ(header.zero, idOf(100));
  EXPECT_EQ(header.cameraFrameId, 70'000 % 65535 + 1U);
  EXPECT_EQ(header.frameNumber, 70'000U);
  EXPECT_EQ(header.deviceTime_ns, 777'070'000);
  EXPECT_EQ(header.exposure_s, 0.004);
  EXPECT_EQ(header.receivedReal_ns, 1'700'000'000'000'000'001);
  EXPECT_EQ(header.captured_ns, 990'000'000);
  EXPECT_EQ(header.capturedError_ns, 12'345);
  EXPECT_EQ(header.capturedBound, CaptureBound::kBoth);
  EXPECT_EQ(header.received_ns, 1'000'000'000);
  EXPECT_EQ(header.tracked_ns, 1'000'200'000);
  EXPECT_EQ(header.solved_ns, 1'000'350'000);
  EXPECT_GT(header.sent_ns, 0);
  EXPECT_EQ(header.arrived_ns, TestClock::now_ns);
}

TEST_F(SubscriberTest, LongestTimeIsNotOverAndTheShortestIs) {
  Subscriber subscriber(at(stream_, kStatus));
  await<Status>(subscriber);
  for (int i = 0; i < 60; ++i) publisher_->publish(field_);  // more messages than are passed over after the timeout
  TestClock::advance(1000ms);
  publisher_->serve(-1, 0ms);
  EXPECT_TRUE(subscriber.receive(std::chrono::milliseconds::max()));
  EXPECT_FALSE(subscriber.receive(std::chrono::milliseconds::min()));
}

TEST_F(SubscriberTest, FieldArrivesNumberByNumber) {
  Subscriber subscriber(at(stream_));
  const Field field = await<Field>(subscriber);
  expectHeader(field.header);
  EXPECT_EQ(field.header.flags, kZeroUnverified);
  EXPECT_TRUE(field.valid);
  ASSERT_EQ(field.force_N.size(), std::size_t{kNodeCount});
  EXPECT_EQ(field.force_N[1], (std::array{3.125F, 4.125F, 5.125F}));
  EXPECT_EQ(field.nodeValid, std::vector<std::uint8_t>(kNodeCount, 1));
  EXPECT_EQ(field.resultant_N, (Vector3{1.0, 2.0, 3.0}));
  EXPECT_EQ(field.moment_Nm, (Vector3{4.0, 5.0, 6.0}));
  EXPECT_EQ(field.centreOfPressure_m, (Vector2{7.0, 8.0}));
  EXPECT_TRUE(field.centreOfPressureValid);
  EXPECT_EQ(field.resultantCovariance_N2.noise, (Matrix3{11, 12, 13, 21, 22, 23, 31, 32, 33}));
  EXPECT_EQ(field.resultantCovariance_N2.systematic, (Matrix3{111, 112, 113, 121, 122, 123, 131, 132, 133}));
  EXPECT_EQ(field.momentCovariance_N2m2.noise, (Matrix3{44, 45, 46, 54, 55, 56, 64, 65, 66}));
  EXPECT_EQ(field.momentCovariance_N2m2.systematic, (Matrix3{144, 145, 146, 154, 155, 156, 164, 165, 166}));
  EXPECT_EQ(field.resultantMomentCovariance_N2m.noise, (Matrix3{14, 15, 16, 24, 25, 26, 34, 35, 36}));
  EXPECT_EQ(field.resultantMomentCovariance_N2m.systematic, (Matrix3{114, 115, 116, 124, 125, 126, 134, 135, 136}));
  EXPECT_EQ(field.residual_px, 9.0);
  EXPECT_EQ(field.validMarkers, kMarkerCount - 1U);
  EXPECT_EQ(field.nodeDeviation_N[1], (std::array{3.0625F, 4.0625F, 5.0625F}));
  EXPECT_EQ(field.method, Method::kContact);
  EXPECT_EQ(field.pictureMotion.shift_px, (Vector2{11.0, 12.0}));
  EXPECT_EQ(field.pictureMotion.scale, 13.0);
  EXPECT_EQ(field.pictureMotion.roll_rad, 14.0);
  ASSERT_EQ(field.contacts.size(), 2U);
  EXPECT_EQ(field.contacts[1].position_m, (Vector2{13.0, 14.0}));
  EXPECT_EQ(field.contacts[1].positionDeviation_m, (Vector2{15.0, 16.0}));
  EXPECT_EQ(field.contacts[1].force_N, (Vector3{17.0, 18.0, 19.0}));
  EXPECT_EQ(field.contacts[1].forceDeviation_N, (Vector3{20.0, 21.0, 22.0}));
  EXPECT_EQ(field.contacts[1].area_m2, 23.0);
  EXPECT_EQ(field.contacts[1].areaDeviation_m2, 24.0);
}

TEST_F(SubscriberTest, MarkersArriveNumberByNumber) {
  Subscriber subscriber(at(stream_));
  const Markers markers = await<Markers>(subscriber);
  expectHeader(markers.header);
  EXPECT_EQ(markers.header.flags, std::uint32_t{kZeroUnverified | kReacquiring});
  ASSERT_EQ(markers.displacement_px.size(), std::size_t{kMarkerCount});
  EXPECT_EQ(markers.displacement_px[1], (std::array{2.5F, 3.5F}));
  EXPECT_EQ(markers.variance_px2[2], 2.25F);
  EXPECT_EQ(markers.valid[0], 1);
  EXPECT_EQ(markers.valid[kMarkerCount - 1], 0);
  EXPECT_EQ(markers.validMarkers, kMarkerCount - 1U);
}

/// Two nodes and one marker.
std::shared_ptr<const sensor::Body> smallBody() {
  sensor::Body body;
  body.nodes = (sensor::Points(3, 2) << 1, 4, 2, 5, 3, 6).finished();
  body.normals = sensor::Points(Eigen::Vector3d::UnitZ().replicate(1, 2));
  body.areas = Eigen::Vector2d(0.25, 0.5);
  body.markers = Eigen::Vector3d(7, 8, 9);
  return std::make_shared<const sensor::Body>(body);
}

TEST_F(SubscriberTest, DescriptionWithoutAGelSaysSo) {
  Description told = tractiond::publish::description();
  told.sensor.reset();
  told.width_px = 333;
  open(told);
  Subscriber subscriber(at(stream_));
  const auto description = await<traction::Description>(subscriber);
  EXPECT_FALSE(description.hasGel());
  EXPECT_EQ(description.nodes.columns, 0U);
  EXPECT_EQ(description.camera.width_px, 333U);
  EXPECT_EQ(description.camera.aspect, 1.0) << "what does not travel is square pixels, as of older daemons";
  EXPECT_EQ(description.camera.model, "Eye");
}

TEST_F(SubscriberTest, DescriptionArrivesFirstAndNumberByNumber) {
  Description told = tractiond::publish::description();
  told.sensor->body = smallBody();
  told.host = tractiond::publish::hostId();
  told.zero = tractiond::publish::restPose();
  told.sensor->camera.aspect = 1.035;
  open(told);
  Subscriber subscriber(at(stream_));
  std::optional<Message> first;
  while (!first) {
    TestClock::advance(50ms);
    publisher_->serve(-1, 5ms);
    first = subscriber.receive(5ms);
  }
  ASSERT_TRUE(std::holds_alternative<traction::Description>(*first));
  const auto& description = std::get<traction::Description>(*first);
  EXPECT_EQ(description.header.sensor, "gel-1");
  EXPECT_EQ(description.softwareVersion, "0.1.0");
  EXPECT_TRUE(description.sameHost);
  EXPECT_EQ(description.topics.size(), 5U);
  EXPECT_TRUE(description.hasGel());
  EXPECT_EQ(description.gel.youngsModulus_Pa, 0.18e6);
  EXPECT_EQ(description.gel.poissonRatio, 0.49);
  EXPECT_EQ(description.gel.size_m, (Vector3{0.1, 0.1, 0.04}));
  ASSERT_EQ(description.layers.size(), 2U);
  EXPECT_EQ(description.layers[0].colour, Colour::kGreen);
  EXPECT_TRUE(description.layers[0].darker);
  EXPECT_EQ(description.layers[1].colour, Colour::kRed);
  EXPECT_FALSE(description.layers[1].darker);
  EXPECT_EQ(description.layers[1].depth_m, 8e-3);
  EXPECT_EQ(description.layers[1].diameter_m, 0.6e-3);
  EXPECT_EQ(description.layers[1].grid.centre_m, (Vector2{1.5e-3, 1.5e-3}));
  EXPECT_EQ(description.nodes.columns, 24U);
  EXPECT_EQ(description.nodes.rows, 24U);
  EXPECT_DOUBLE_EQ(description.nodes.position_m(0, 0)[0], -34.5e-3);
  EXPECT_DOUBLE_EQ(description.nodes.position_m(0, 23)[1], 34.5e-3);
  EXPECT_EQ(description.camera.vendor, "Acme");
  EXPECT_EQ(description.camera.pixelFormat, "RGB8");
  EXPECT_EQ(description.camera.width_px, 640U);
  EXPECT_EQ(description.camera.aspect, 1.035);
  EXPECT_EQ(description.camera.principal_px, (Vector2{319.5, 239.5}));
  EXPECT_EQ(description.camera.position_m[2], 157e-3);
  ASSERT_TRUE(description.body);
  EXPECT_EQ(description.body->nodePositions_m, (std::vector<std::array<float, 3>>{{1, 2, 3}, {4, 5, 6}}));
  EXPECT_EQ(description.body->nodeNormals, (std::vector<std::array<float, 3>>{{0, 0, 1}, {0, 0, 1}}));
  EXPECT_EQ(description.body->nodeAreas_m2, (std::vector<float>{0.25F, 0.5F}));
  EXPECT_EQ(description.body->markerPositions_m, (std::vector<std::array<float, 3>>{{7, 8, 9}}));
  EXPECT_EQ(description.solver.mechanics, "block");
  EXPECT_EQ(description.calibration.id, idOf(20));
  EXPECT_EQ(description.calibration.time_ns, told.calibrated_ns);
  ASSERT_TRUE(description.zero);
  EXPECT_EQ(description.zero->id, idOf(50));
  EXPECT_TRUE(description.zero->requested);
  EXPECT_EQ(description.zero->restPosition_px[1], (std::array{3.0F, 4.0F}));
  EXPECT_EQ(description.zero->markerPresent, (std::vector<std::uint8_t>{1, 0}));
}

TEST_F(SubscriberTest, StatusArrivesWithTheLedger) {
  ledger_.received.add(100);
  ledger_.published.add(90);
  ledger_.stale.add(7);
  ledger_.missing.add(5);
  Subscriber subscriber(at(stream_, kStatus));
  const Status status = await<Status>(subscriber);
  EXPECT_EQ(status->camera(), v1::CAMERA_STATE_UNKNOWN);
  EXPECT_EQ(status->ledger().received(), 100U);
  EXPECT_EQ(status->ledger().published(), 90U);
  EXPECT_EQ(status->ledger().stale(), 7U);
  EXPECT_EQ(status->ledger().in_flight(), 3U);
  EXPECT_EQ(status->ledger().missing(), 5U);
  EXPECT_DOUBLE_EQ(status->latencies().track().p50_s(), 200e-6);
  EXPECT_GT(status->rates().published_hz(), 0.0);
}

TEST_F(SubscriberTest, OtherTopicsAreLeftOut) {
  Subscriber subscriber(at(stream_, kMarkers));
  await<Markers>(subscriber);
  for (int i = 0; i < 3; ++i) publisher_->publish(field_);
  for (int i = 0; i < 3; ++i) {
    const auto message = subscriber.receive(kHung);
    ASSERT_TRUE(message);
    EXPECT_TRUE(std::holds_alternative<Markers>(*message));
  }
}

TEST_F(SubscriberTest, PreviewsAreMadeForWhoWantsThem) {
  {
    Subscriber subscriber(at(stream_));
    await<Field>(subscriber);
    EXPECT_FALSE(publisher_->previewWanted());
  }
  Subscriber subscriber(at(stream_, kPreview));
  std::optional<Message> message;
  for (int i = 0; i < 1000 && !message; ++i) {
    publisher_->serve(-1, 0ms);
    publisher_->publish(field_);
    if (publisher_->previewWanted()) {
      publisher_->offerPreview(
          {.picture = {1, 2, 3, {1, 2, 3, 4, 5, 6}}, .factor = 2, .info = {}, .flags = 0, .zero = {}});
    }
    message = subscriber.receive(5ms);
  }
  ASSERT_TRUE(message && std::holds_alternative<Preview>(*message));
  const auto& preview = std::get<Preview>(*message);
  EXPECT_EQ(preview.header.sensor, "gel-1");
  EXPECT_EQ(preview.width, 1U);
  EXPECT_EQ(preview.height, 2U);
  EXPECT_EQ(preview.channels, 3U);
  EXPECT_EQ(preview.pixels, (std::vector<std::uint8_t>{1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(preview.scale, 2.0);
  EXPECT_EQ(preview.origin_px, (Vector2{0.5, 0.5}));
}

TEST_F(SubscriberTest, LatestGivesFields) {
  Subscriber subscriber(at(latest_, kAllTopics, Mode::kLatest));
  expectHeader(await<Field>(subscriber).header);
  EXPECT_EQ(subscriber.lost(), 0U);
}

TEST_F(SubscriberTest, NothingComesAfterTheTimeout) {
  Subscriber subscriber(at(stream_, kField));
  EXPECT_FALSE(subscriber.receive(1ms));
}

TEST_F(SubscriberTest, ConnectionIsTold) {
  Subscriber alone(at("ipc://@traction-nobody-is-here"));
  EXPECT_FALSE(alone.isConnected());
  Subscriber subscriber(at(stream_));
  expectConnected(subscriber, true);
}

}  // namespace
}  // namespace traction::subscriber_test
