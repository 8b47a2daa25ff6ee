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

TEST_F(SubscriberTest, LatestGivesFields) {
  Subscriber subscriber(at(latest_, kAllTopics, Mode::kLatest));
  expectHeader(await<Field>(subscriber).header);
  EXPECT_EQ(subscriber.lost(), 0U);
}

}  // namespace
}  // namespace traction::subscriber_test
