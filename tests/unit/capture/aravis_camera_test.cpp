// The camera at work: packets and their size, its stream, death and return.
#include "tests/unit/capture/aravis_camera_bench.h"
#include "tests/unit/capture/own_network.h"

#include <gtest/gtest.h>

namespace tractiond::capture::aravis_camera_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

TEST_F(AravisCameraTest, NegotiatesAndProvesThePacketSize) {
  fake();
  ASSERT_NO_FATAL_FAILURE(open());
  EXPECT_EQ(camera_->info()->packetSize_bytes, 8996);
  EXPECT_TRUE(camera_->info()->packetSizeVerified);
  EXPECT_EQ(camera_->info()->receiveBuffer_bytes, options_.receiveBuffer_bytes);
  EXPECT_THAT(camera_->info()->warnings, IsEmpty());
}

TEST_F(AravisCameraTest, FallsBackToPacketsThatArrive) {
  // A switch on the way that carries less than the interface does.
  ASSERT_EQ(std::system("tc qdisc add dev lo root tbf rate 10gbit burst 4000 latency 50ms"), 0);
  fake();
  ASSERT_NO_FATAL_FAILURE(open());
  EXPECT_EQ(camera_->info()->packetSize_bytes, 1444);
  EXPECT_TRUE(camera_->info()->packetSizeVerified);
  stream(3);
  EXPECT_EQ(ledger_.losses(), 0U);
  EXPECT_EQ(std::system("tc qdisc delete dev lo root"), 0);
}

TEST_F(AravisCameraTest, RefusesPacketsAboveTheMtu) {
  fake();
  ASSERT_EQ(std::system("ip link set lo mtu 1500"), 0);
  options_.packetSize_bytes = 9000;
  const Error error = openFails();
  EXPECT_EQ(error.exitCode, EX_CONFIG);
  EXPECT_THAT(error.message(), HasSubstr("MTU"));
  EXPECT_THAT(error.message(), HasSubstr("1500"));
  options_.packetSize_bytes = 0;
  ASSERT_NO_FATAL_FAILURE(open());
  EXPECT_EQ(camera_->info()->packetSize_bytes, 1444);
  stream(3);
  EXPECT_EQ(std::system("ip link set lo mtu 65536"), 0);
}

TEST_F(AravisCameraTest, WarnsOfASmallReceiveBufferWithTheRemedy) {
  fake();
  options_.receiveBuffer_bytes = 1 << 30;
  ASSERT_NO_FATAL_FAILURE(open());
  EXPECT_LT(camera_->info()->receiveBuffer_bytes, 1 << 30);
  EXPECT_GT(camera_->info()->receiveBuffer_bytes, 0);
  EXPECT_THAT(camera_->info()->warnings, ElementsAre(HasSubstr("sysctl -w net.core.rmem_max=1073741824")));
}

TEST_F(AravisCameraTest, TakesControlAgainWhereItWasTakenAway) {
  constexpr std::uint32_t kControlPrivilege = 0x0a00;
  fake();
  options_.silenceTimeout_ms = 0;  // the pictures still come
  ASSERT_NO_FATAL_FAILURE(open());
  ASSERT_NO_FATAL_FAILURE(stream(10));
  fake_->write(kControlPrivilege, 0);
  const std::int64_t until_ns = monotonicNow() + 20'000'000'000;
  Frame one;
  while (ledger_.reconnects.get() == 0 && monotonicNow() < until_ns)
    if (camera_->next(one, milliseconds(50)) == Next::kFrame) camera_->recycle(one);
  EXPECT_EQ(ledger_.reconnects.get(), 1U);
  EXPECT_NE(fake_->read(kControlPrivilege), 0U);
  stream(10);
}

}  // namespace
}  // namespace tractiond::capture::aravis_camera_test

int main(int argc, char** argv) {
  tractiond::test::enterOwnNetwork(argc, argv);
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
