// The camera at work: packets and their size, its stream, death and return.
#include "tests/support/steady.h"
#include "tests/unit/capture/aravis_camera_bench.h"
#include "tests/unit/capture/own_network.h"

#include <string_view>
#include <thread>

namespace tractiond::capture::aravis_camera_test {
namespace {

using test::CameraProcess;
using test::Intruder;
using test::readRegister;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

TEST_F(AravisCameraTest, NegotiatesAndProvesThePacketSize) {
  fake();
  ASSERT_NO_FATAL_FAILURE(open());
  EXPECT_EQ(camera_->info()->packetSize_bytes, 8996);
  EXPECT_TRUE(camera_->info()->packetSizeVerified);
  EXPECT_FALSE(camera_->info()->packetSocket);
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

TEST_F(AravisCameraTest, TellsWhenItUsesAPacketSocket) {
  fake();
  options_.packetSocket = PacketSocket::kAuto;
  ASSERT_NO_FATAL_FAILURE(open());
  EXPECT_TRUE(camera_->info()->packetSocket) << "root of this namespace may";
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

TEST_F(AravisCameraTest, LosesNoFrameWhereTheCounterWraps) {
  fake(FakeCamera::Options{.rate_Hz = 100});  // slow enough for a busy machine
  ASSERT_NO_FATAL_FAILURE(open());
  stream(1);
  EXPECT_GT(lastId_, 65'000U);
  stream(300);
  EXPECT_LT(lastId_, 400U);
  EXPECT_EQ(lastNumber_, 301U);
  EXPECT_EQ(ledger_.received.get(), 301U);
  EXPECT_EQ(ledger_.losses(), 0U);
  EXPECT_EQ(ledger_.missing.get(), 0U);
}

TEST_F(AravisCameraTest, AccountsForEveryFrameOfALossyNetwork) {
  fake(FakeCamera::Options{.width = 128, .height = 96, .rate_Hz = 400});
  options_.packetSize_bytes = 1500;
  ASSERT_NO_FATAL_FAILURE(open());
  stream(10);
  fake_->losePackets(0.02);
  stream(300);
  fake_->losePackets(0.0);
  stream(20);
  EXPECT_GT(ledger_.incomplete.get(), 50U);
  EXPECT_EQ(ledger_.received.get(), 330U + ledger_.losses());
  EXPECT_EQ(lastNumber_, ledger_.received.get() + ledger_.missing.get());
}

TEST_F(AravisCameraTest, CountsPicturesOfAnotherSizeOrFormat) {
  fake(FakeCamera::Options{.width = 64, .height = 48, .format = ARV_PIXEL_FORMAT_BAYER_RG_8});
  ASSERT_NO_FATAL_FAILURE(open());
  stream(5);
  const auto refuseUntil = [&](const Counter& counter) {
    Frame one;
    const std::int64_t until_ns = monotonicNow() + 5'000'000'000;
    while (counter.get() < 3 && monotonicNow() < until_ns)
      if (camera_->next(one, milliseconds(100)) == Next::kFrame) camera_->recycle(one);
    EXPECT_GE(counter.get(), 3U);
  };
  fake_->write(ARV_FAKE_CAMERA_REGISTER_WIDTH, 60);
  refuseUntil(ledger_.wrongSize);
  fake_->write(ARV_FAKE_CAMERA_REGISTER_WIDTH, 64);
  stream(5);
  fake_->write(ARV_FAKE_CAMERA_REGISTER_PIXEL_FORMAT, ARV_PIXEL_FORMAT_BAYER_GB_8);
  refuseUntil(ledger_.wrongFormat);
  fake_->write(ARV_FAKE_CAMERA_REGISTER_PIXEL_FORMAT, ARV_PIXEL_FORMAT_BAYER_RG_8);
  stream(5);
  EXPECT_EQ(ledger_.missing.get(), 0U);
}

class AravisCameraIntruder : public AravisCameraTest, public testing::WithParamInterface<int> {};

TEST_P(AravisCameraIntruder, GetsNoOldBufferHandedOn) {
  fake({.rate_Hz = 200});
  ASSERT_NO_FATAL_FAILURE(open());
  const Intruder intruder(*fake_);
  ASSERT_NO_FATAL_FAILURE(stream(50));
  for (int i = 0; i < 5; ++i) {
    intruder.send(std::vector<std::uint8_t>(static_cast<std::size_t>(GetParam())));
    ASSERT_NO_FATAL_FAILURE(stream(20));  // each newer than the one before
  }
  EXPECT_EQ(ledger_.received.get() - ledger_.losses(), 150U);
  EXPECT_EQ(ledger_.stale.get(), 0U) << "Aravis calls each of them a success, had it reached it";
}

INSTANTIATE_TEST_SUITE_P(ZeroBytes, AravisCameraIntruder, testing::Values(8, 44, 1000, 8972));

TEST_F(AravisCameraTest, CountsAForgedFutureIdAndGoesOn) {
  fake({.rate_Hz = 200});
  ASSERT_NO_FATAL_FAILURE(open());
  const Intruder intruder(*fake_);
  ASSERT_NO_FATAL_FAILURE(stream(50));
  const std::vector<std::uint8_t> forged(64 * 48 * 3, 0xff);  // its number would be the highest of all
  const auto id = static_cast<std::uint16_t>((lastId_ + 1000) % 65'535 + 1);
  intruder.sendPicture(id, static_cast<std::uint64_t>(realNow()), 64, 48, ARV_PIXEL_FORMAT_RGB_8_PACKED, forged,
                       camera_->info()->packetSize_bytes);
  ASSERT_NO_FATAL_FAILURE(stream(50));
  EXPECT_EQ(ledger_.implausible.get(), 1U);
  EXPECT_EQ(ledger_.received.get() - ledger_.losses(), 100U);
  EXPECT_EQ(ledger_.stale.get(), 0U);
}

TEST_F(AravisCameraTest, ComesBackWithItsSettingsAfterTheCameraDied) {
  auto process = std::make_unique<CameraProcess>();  // its own picture: 512 x 512, Mono8
  options_.pixelFormat = "RGB8";
  options_.width = 64;
  options_.height = 48;
  options_.frameRate_Hz = 100;
  options_.features = {{"GainRaw", std::int64_t{5}}};
  options_.silenceTimeout_ms = 200;
  ASSERT_NO_FATAL_FAILURE(open());
  EXPECT_EQ(readRegister(ARV_FAKE_CAMERA_REGISTER_GAIN_RAW), 5U);
  ASSERT_NO_FATAL_FAILURE(stream(20));
  Frame out;  // still in the pipeline when its stream dies
  ASSERT_NO_FATAL_FAILURE(frame(out));

  process->kill();
  Frame one;
  for (int silent = 0; silent < 20;) silent = camera_->next(one, milliseconds(50)) == Next::kTimeout ? silent + 1 : 0;
  process = std::make_unique<CameraProcess>();
  const std::int64_t until_ns = monotonicNow() + 30'000'000'000;
  Next next = Next::kTimeout;
  while (next != Next::kFrame && monotonicNow() < until_ns) next = camera_->next(one, milliseconds(100));
  ASSERT_EQ(next, Next::kFrame);
  EXPECT_EQ(ledger_.reconnects.get(), 1U);
  EXPECT_TRUE(one.info.discontinuity);
  EXPECT_GT(one.info.frameNumber, out.info.frameNumber);
  EXPECT_GT(one.info.times.captured_ns, out.info.times.captured_ns);
  EXPECT_EQ(one.width, 64);
  EXPECT_EQ(one.format, PixelFormat::kRgb8);
  EXPECT_EQ(readRegister(ARV_FAKE_CAMERA_REGISTER_GAIN_RAW), 5U);
  EXPECT_EQ(readRegister(ARV_FAKE_CAMERA_REGISTER_ACQUISITION_FRAME_PERIOD_US), 10'000U);
  camera_->recycle(out);
  camera_->recycle(one);
  lastPainted_ = 0;
  lastNumber_ = one.info.frameNumber;
  stream(50);
  EXPECT_EQ(ledger_.losses(), 0U);
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

TEST_F(AravisCameraTest, MayEndWhileTheCameraIsAway) {
  auto process = std::make_unique<CameraProcess>();
  options_.pixelFormat = "RGB8";
  options_.silenceTimeout_ms = 100;
  ASSERT_NO_FATAL_FAILURE(open());
  ASSERT_NO_FATAL_FAILURE(stream(3));
  process->kill();
  Frame one;
  for (int silent = 0; silent < 5;) silent = camera_->next(one, milliseconds(50)) == Next::kTimeout ? silent + 1 : 0;
  camera_.reset();
}

TEST_F(AravisCameraTest, MayEndRightAfterTheCameraDied) {
  auto process = std::make_unique<CameraProcess>();
  options_.pixelFormat = "RGB8";
  ASSERT_NO_FATAL_FAILURE(open());
  ASSERT_NO_FATAL_FAILURE(stream(3));
  process->kill();
  camera_.reset();
}

}  // namespace
}  // namespace tractiond::capture::aravis_camera_test

int main(int argc, char** argv) {
  if (argc > 1 && std::string_view(argv[1]) == "--fake-camera") return tractiond::test::CameraProcess::main();
  tractiond::test::enterOwnNetwork(argc, argv);
  return tractiond::test::runWhereTheMachineIsSteady(argc, argv);
}
