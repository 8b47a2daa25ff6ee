// What the daemon's publisher sends arrives at the client library; tests/conformance compares every number.
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

TEST_F(SubscriberTest, DescriptionArrivesFirst) {
  Subscriber subscriber(at(stream_));
  std::optional<Message> first;
  while (!first) {
    TestClock::advance(50ms);
    publisher_->serve(-1, 5ms);
    first = subscriber.receive(5ms);
  }
  EXPECT_TRUE(std::holds_alternative<traction::Description>(*first));
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
