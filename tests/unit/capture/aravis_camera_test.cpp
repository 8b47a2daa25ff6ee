// Aravis's own GigE Vision camera, found, set and streaming over a loopback of its own.
#include "base/clock.h"
#include "daemon/capture/aravis_driver.h"
#include "daemon/capture/camera.h"
#include "tests/unit/capture/fake_camera.h"

#include <arv.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <memory>

namespace tractiond::capture::aravis_camera_test {
namespace {

using std::chrono::milliseconds;
using test::FakeCamera;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class AravisCameraTest : public testing::Test {
 protected:
  tl::expected<std::unique_ptr<Camera>, Error> tryToOpen() {
    return Camera::open(fromAravis(options_), {.wait = false, .silenceTimeout_ms = options_.silenceTimeout_ms},
                        ledger_);
  }
  void open() {
    auto opened = tryToOpen();
    ASSERT_TRUE(opened) << opened.error().message();
    camera_ = std::move(*opened);
  }
  void expectRefused(int exitCode, std::initializer_list<const char*> words) {
    const auto opened = tryToOpen();
    ASSERT_FALSE(opened);
    EXPECT_EQ(opened.error().exitCode, exitCode);
    for (const char* word : words) EXPECT_THAT(opened.error().message(), HasSubstr(word));
  }
  /// Uses pictures, which must be of `size` bytes; fails the test if one does not come within five seconds.
  void stream(int frames, std::size_t size = std::size_t{64} * 48 * 3) {
    const std::int64_t until_ns = monotonicNow() + 5'000'000'000;
    for (Frame one; frames > 0;) {
      ASSERT_LT(monotonicNow(), until_ns) << "no frame";
      if (camera_->next(one, milliseconds(100)) != Next::kFrame) continue;
      EXPECT_EQ(one.size, size);
      camera_->recycle(one);
      --frames;
    }
  }

  CameraOptions options_{.receiveBuffer_bytes = 2 << 20};
  Ledger ledger_;
  FakeCamera fake_;
  std::unique_ptr<Camera> camera_;
};

// ---------------------------------------------------------------- finding it

class AravisCameraNames : public AravisCameraTest, public testing::WithParamInterface<const char*> {};

TEST_P(AravisCameraNames, OpenTheCamera) {
  const FakeCamera other(FakeCamera::Options{.address = "127.0.0.2", .serial = "GV02"});
  options_.id = GetParam();
  ASSERT_NO_FATAL_FAILURE(open());
  EXPECT_EQ(camera_->info()->name.id, "Aravis-Fake-GV02");
  EXPECT_EQ(camera_->info()->name.address, "127.0.0.2");
  stream(3);
}

INSTANTIATE_TEST_SUITE_P(Kinds, AravisCameraNames, testing::Values("Aravis-Fake-GV02", "aravis-gv02", "127.0.0.2"));

TEST_F(AravisCameraTest, NamesTheCamerasInSightWhenItsOwnIsNot) {
  options_.id = "Nobody-123";
  expectRefused(EX_UNAVAILABLE, {"Nobody-123", "Aravis-Fake-GV01"});
}

// ---------------------------------------------------------------- setting it

TEST_F(AravisCameraTest, AppliesSettingsInOrderAndReadsThemBack) {
  options_.width = 128;
  options_.height = 96;
  options_.pixelFormat = "BayerRG8";
  options_.frameRate_Hz = 60;
  options_.exposure_us = 2500;
  options_.features = {{"GainRaw", std::int64_t{3}},
                       {"ExposureTimeAbs", 1234.4},
                       {"GainRaw", std::int64_t{7}},
                       {"TriggerMode", std::string("Off")}};
  ASSERT_NO_FATAL_FAILURE(open());
  EXPECT_EQ(fake_.read(ARV_FAKE_CAMERA_REGISTER_PIXEL_FORMAT), ARV_PIXEL_FORMAT_BAYER_RG_8);
  EXPECT_EQ(fake_.read(ARV_FAKE_CAMERA_REGISTER_GAIN_RAW), 7U);
  EXPECT_EQ(fake_.read(ARV_FAKE_CAMERA_REGISTER_EXPOSURE_TIME_US), 2500U) << "tractiond's own keys come last";
  const CameraInfo info = *camera_->info();
  EXPECT_THAT(info.settings, ElementsAre("GainRaw = 3", "ExposureTimeAbs = 1234 (asked: 1234.4)", "GainRaw = 7",
                                         "TriggerMode = Off", "PixelFormat = BayerRG8", "Width = 128", "Height = 96",
                                         HasSubstr("frame_rate_hz = 60.0024"), "exposure_us = 2500"));
  EXPECT_THAT(info.warnings, ElementsAre("the camera made ExposureTimeAbs = 1234 (asked: 1234.4)"));
  EXPECT_NEAR(info.exposure_s, 2500e-6, 1e-9);
  stream(3, std::size_t{128} * 96);
}

TEST_F(AravisCameraTest, ATriggerSetBeforeTheRateStays) {
  options_.frameRate_Hz = 60;
  options_.features = {{"TriggerSelector", std::string("FrameStart")},
                       {"TriggerSource", std::string("Software")},
                       {"TriggerMode", std::string("On")}};
  ASSERT_NO_FATAL_FAILURE(open());
  EXPECT_EQ(fake_.read(ARV_FAKE_CAMERA_REGISTER_TRIGGER_MODE), 1U);
  EXPECT_FALSE(camera_->info()->packetSizeVerified) << "nothing has come yet";
}

TEST_F(AravisCameraTest, ChoosesAFormatWhereItsOwnCannotBeRead) {
  fake_.write(ARV_FAKE_CAMERA_REGISTER_PIXEL_FORMAT, ARV_PIXEL_FORMAT_RGB_8_PLANAR);
  ASSERT_NO_FATAL_FAILURE(open());
  EXPECT_TRUE(traitsOf(camera_->info()->format).isBayer()) << "the fewest bytes with colours";
  EXPECT_THAT(camera_->info()->settings, Contains(HasSubstr("8 (chosen")));
}

TEST_F(AravisCameraTest, NamesTheSideThatCannotBeAndWhatMayBe) {
  for (const auto& [side, says] : {std::pair(0U, "says Height = 0 pixels, possible are 1 to "),
                                   std::pair(__builtin_bswap32(480U), "in the other order it is 480"),
                                   std::pair(70'000U, "says Height = 70000 pixels")}) {
    fake_.write(ARV_FAKE_CAMERA_REGISTER_HEIGHT, side);
    expectRefused(EX_UNAVAILABLE, {says});
  }
  std::cout << "  a Height of 0, of the other byte order, of 70000: the refusal names it and what is possible; "
               "right: a refusal that names them\n";
}

// ---------------------------------------------------------------- packets

TEST_F(AravisCameraTest, WarnsOfTwoInterfacesInItsNetwork) {
  ASSERT_EQ(std::system("ip link add nic1 type veth peer nic2 && ip address add 10.9.0.1/24 dev nic1 && "
                        "ip address add 10.9.0.2/24 dev nic2 && ip link set nic1 up && ip link set nic2 up"),
            0);
  const FakeCamera there(FakeCamera::Options{.address = "10.9.0.2", .serial = "GV02"});
  options_.id = "10.9.0.2";
  ASSERT_NO_FATAL_FAILURE(open());
  EXPECT_THAT(camera_->info()->warnings, Contains(HasSubstr("are all in the network of 10.9.0.2")));
  camera_.reset();
  options_.id = "10.9.0.77";
  expectRefused(EX_UNAVAILABLE, {"10.9.0.77", "does not answer", "nic1", "nic2", "are all in the network"});
  std::cout
      << "  two interfaces in one network: both are named, with and without an answer of the camera; right: named\n";
  EXPECT_EQ(std::system("ip link delete nic1"), 0);
}

TEST_F(AravisCameraTest, NegotiatesAndProvesThePacketSize) {
  ASSERT_NO_FATAL_FAILURE(open());
  EXPECT_EQ(camera_->info()->packetSize_bytes, 8996);
  EXPECT_TRUE(camera_->info()->packetSizeVerified);
  EXPECT_EQ(camera_->info()->receiveBuffer_bytes, options_.receiveBuffer_bytes);
  EXPECT_THAT(camera_->info()->warnings, IsEmpty());
}

TEST_F(AravisCameraTest, FallsBackToPacketsThatArrive) {
  // A switch on the way that carries less than the interface does.
  ASSERT_EQ(std::system("tc qdisc add dev lo root tbf rate 10gbit burst 4000 latency 50ms"), 0);
  ASSERT_NO_FATAL_FAILURE(open());
  EXPECT_EQ(camera_->info()->packetSize_bytes, 1444);
  EXPECT_TRUE(camera_->info()->packetSizeVerified);
  stream(3);
  EXPECT_EQ(ledger_.losses(), 0U);
  EXPECT_EQ(std::system("tc qdisc delete dev lo root"), 0);
}

TEST_F(AravisCameraTest, RefusesPacketsAboveTheMtu) {
  ASSERT_EQ(std::system("ip link set lo mtu 1500"), 0);
  options_.packetSize_bytes = 9000;
  expectRefused(EX_CONFIG, {"MTU", "1500"});
  options_.packetSize_bytes = 0;
  ASSERT_NO_FATAL_FAILURE(open());
  EXPECT_EQ(camera_->info()->packetSize_bytes, 1444);
  stream(3);
  EXPECT_EQ(std::system("ip link set lo mtu 65536"), 0);
}

TEST_F(AravisCameraTest, WarnsOfASmallReceiveBufferWithTheRemedy) {
  options_.receiveBuffer_bytes = 1 << 30;
  ASSERT_NO_FATAL_FAILURE(open());
  EXPECT_LT(camera_->info()->receiveBuffer_bytes, 1 << 30);
  EXPECT_GT(camera_->info()->receiveBuffer_bytes, 0);
  EXPECT_THAT(camera_->info()->warnings, ElementsAre(HasSubstr("sysctl -w net.core.rmem_max=1073741824")));
}

TEST_F(AravisCameraTest, TakesControlAgainWhereItWasTakenAway) {
  constexpr std::uint32_t kControlPrivilege = 0x0a00;
  options_.silenceTimeout_ms = 0;  // the pictures still come
  ASSERT_NO_FATAL_FAILURE(open());
  stream(10);
  fake_.write(kControlPrivilege, 0);
  const std::int64_t until_ns = monotonicNow() + 20'000'000'000;
  while (ledger_.reconnects.get() == 0 && monotonicNow() < until_ns) stream(1);
  EXPECT_EQ(ledger_.reconnects.get(), 1U);
  EXPECT_NE(fake_.read(kControlPrivilege), 0U);
  stream(10);
}

}  // namespace
}  // namespace tractiond::capture::aravis_camera_test
