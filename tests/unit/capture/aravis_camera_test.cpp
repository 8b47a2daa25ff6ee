// The camera driver against Aravis's own GigE Vision camera, over a loopback of their own.
#include "base/clock.h"
#include "daemon/capture/aravis_driver.h"
#include "daemon/capture/camera.h"
#include "daemon/capture/camera_list.h"
#include "tests/support/steady.h"
#include "tests/unit/capture/fake_camera.h"
#include "tests/unit/capture/own_network.h"

#include <arv.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <future>
#include <map>
#include <memory>
#include <string_view>
#include <thread>

namespace tractiond::capture::aravis_camera_test {
namespace {

using std::chrono::milliseconds;
using test::CameraProcess;
using test::FakeCamera;
using test::Intruder;
using test::readRegister;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class AravisCameraTest : public testing::Test {
 protected:
  AravisCameraTest() {
    options_.wait = false;
    options_.receiveBuffer_bytes = 2 << 20;
  }

  tl::expected<std::unique_ptr<Camera>, Error> openWith(Ledger& ledger, const Say& say = {}) {
    return Camera::open(
        fromAravis(options_),
        {.wait = options_.wait, .silenceTimeout_ms = options_.silenceTimeout_ms, .buffers = options_.buffers}, ledger,
        say);
  }
  void open() {
    auto opened = openWith(ledger_);
    ASSERT_TRUE(opened) << opened.error().message();
    camera_ = std::move(*opened);
  }
  Error openFails() {
    auto opened = openWith(ledger_);
    EXPECT_FALSE(opened);
    return opened ? Error{} : opened.error();
  }
  /// The next picture that is used; fails the test after five seconds.
  void frame(Frame& frame) {
    const std::int64_t until_ns = monotonicNow() + 5'000'000'000;
    while (monotonicNow() < until_ns)
      if (camera_->next(frame, milliseconds(100)) == Next::kFrame) return;
    FAIL() << "no frame";
  }
  static std::uint64_t painted(const Frame& frame) {
    std::uint64_t count = 0;
    std::memcpy(&count, frame.data, sizeof count);
    return count;
  }
  /// Uses `frames` pictures and expects each to be newer than the last.
  void stream(int frames) {
    for (int i = 0; i < frames; ++i) {
      Frame one;
      ASSERT_NO_FATAL_FAILURE(frame(one));
      ASSERT_GT(painted(one), lastPainted_);
      ASSERT_GT(one.info.frameNumber, lastNumber_);
      ASSERT_GE(one.info.times.captured_ns, lastCaptured_ns_);
      ASSERT_LE(one.info.times.captured_ns, one.info.times.received_ns);
      lastPainted_ = painted(one);
      lastNumber_ = one.info.frameNumber;
      lastCaptured_ns_ = one.info.times.captured_ns;
      lastId_ = one.info.cameraFrameId;
      camera_->recycle(one);
    }
  }

  FakeCamera& fake(const FakeCamera::Options& options = {}) {
    fake_.reset();
    fake_ = std::make_unique<FakeCamera>(options);
    return *fake_;
  }

  CameraOptions options_;
  Ledger ledger_;
  std::unique_ptr<FakeCamera> fake_;
  std::unique_ptr<Camera> camera_;
  std::uint64_t lastPainted_ = 0, lastNumber_ = 0, lastId_ = 0;
  std::int64_t lastCaptured_ns_ = 0;
};

// ---------------------------------------------------------------- finding

class AravisCameraNames : public AravisCameraTest, public testing::WithParamInterface<const char*> {};

TEST_P(AravisCameraNames, OpenTheCamera) {
  fake();
  options_.id = GetParam();
  ASSERT_NO_FATAL_FAILURE(open());
  EXPECT_EQ(camera_->info()->name.id, "Aravis-Fake-GV01");
  EXPECT_EQ(camera_->info()->name.address, "127.0.0.1");
  stream(3);
}

INSTANTIATE_TEST_SUITE_P(Kinds, AravisCameraNames,
                         testing::Values("", "Aravis-Fake-GV01", "Aravis-GV01", "127.0.0.1", "00:00:00:00:00:00"));

TEST_F(AravisCameraTest, ListsWhatIsThere) {
  fake();
  const FakeCamera other(FakeCamera::Options{.address = "127.0.0.2", .serial = "GV02"});
  const std::vector<CameraName> all = listCameras();
  std::map<std::string, CameraName> byAddress;
  for (const CameraName& name : all) byAddress[name.address] = name;
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(byAddress["127.0.0.1"].id, "Aravis-Fake-GV01");
  EXPECT_EQ(byAddress["127.0.0.2"].serial, "GV02");
  EXPECT_EQ(byAddress["127.0.0.2"].vendor, "Aravis");
  EXPECT_EQ(byAddress["127.0.0.2"].model, "Fake");
  EXPECT_EQ(byAddress["127.0.0.2"].protocol, "GigEVision");
}

TEST_F(AravisCameraTest, ListsAravisOwnTestCameraOnRequestOnly) {
  EXPECT_THAT(listCameras(), IsEmpty());
  ASSERT_EQ(listCameras(true).size(), 1U);
}

TEST_F(AravisCameraTest, TellsTwoCamerasApart) {
  fake();
  const FakeCamera other(FakeCamera::Options{.address = "127.0.0.2", .serial = "GV02"});
  options_.id = "Aravis-GV02";
  ASSERT_NO_FATAL_FAILURE(open());
  EXPECT_EQ(camera_->info()->name.address, "127.0.0.2");
  stream(3);
}

TEST_F(AravisCameraTest, NamesTheCamerasInSightWhenItsOwnIsNot) {
  fake();
  options_.id = "Nobody-123";
  const Error error = openFails();
  EXPECT_EQ(error.exitCode, EX_UNAVAILABLE);
  EXPECT_THAT(error.message(), HasSubstr("Nobody-123"));
  EXPECT_THAT(error.message(), HasSubstr("Aravis-Fake-GV01"));
}

TEST_F(AravisCameraTest, IsUnavailableWhenNoneAnswers) {
  EXPECT_EQ(openFails().exitCode, EX_UNAVAILABLE);
}

TEST_F(AravisCameraTest, EndsWhileItWaitsForACamera) {
  options_.wait = true;
  ASSERT_NO_FATAL_FAILURE(open());
  EXPECT_EQ(camera_->state(), CameraState::kWaiting);
  EXPECT_EQ(camera_->info(), nullptr);
  Frame one;
  EXPECT_EQ(camera_->next(one, milliseconds(1)), Next::kTimeout);
  camera_.reset();
}

TEST_F(AravisCameraTest, WaitsForACameraThatComesLater) {
  options_.wait = true;
  std::vector<std::string> said;
  auto opened = openWith(ledger_, [&](LogLevel, const std::string& line) { said.push_back(line); });
  ASSERT_TRUE(opened) << opened.error().message();
  camera_ = std::move(*opened);
  EXPECT_THAT(said, ElementsAre(HasSubstr("waiting for a camera")));
  fake();
  stream(3);
  EXPECT_EQ(camera_->state(), CameraState::kStreaming);
}

TEST_F(AravisCameraTest, SaysThatAnotherClientHoldsTheCamera) {
  fake();
  ASSERT_NO_FATAL_FAILURE(open());
  Ledger other;
  const auto second = openWith(other);
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().exitCode, EX_TEMPFAIL);
  EXPECT_THAT(second.error().message(), HasSubstr("held by another client"));
  stream(20);  // and the first one goes on
}

TEST_F(AravisCameraTest, TakesTheCameraOverWhenItsHolderLeaves) {
  fake();
  ASSERT_NO_FATAL_FAILURE(open());
  Ledger other;
  std::promise<void> held;
  auto second = std::async(std::launch::async, [&] {
    return openWith(other, [&, told = false](LogLevel, const std::string&) mutable {
      if (!std::exchange(told, true)) held.set_value();
    });
  });
  held.get_future().wait();
  camera_.reset();
  auto opened = second.get();
  ASSERT_TRUE(opened) << opened.error().message();
}

// ---------------------------------------------------------------- setting

TEST_F(AravisCameraTest, AppliesSettingsInOrderAndReadsThemBack) {
  fake();
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
  EXPECT_EQ(fake_->read(ARV_FAKE_CAMERA_REGISTER_WIDTH), 128U);
  EXPECT_EQ(fake_->read(ARV_FAKE_CAMERA_REGISTER_HEIGHT), 96U);
  EXPECT_EQ(fake_->read(ARV_FAKE_CAMERA_REGISTER_PIXEL_FORMAT), ARV_PIXEL_FORMAT_BAYER_RG_8);
  EXPECT_EQ(fake_->read(ARV_FAKE_CAMERA_REGISTER_GAIN_RAW), 7U);
  EXPECT_EQ(fake_->read(ARV_FAKE_CAMERA_REGISTER_EXPOSURE_TIME_US), 2500U) << "tractiond's own keys come last";
  const CameraInfo info = *camera_->info();
  EXPECT_THAT(info.settings, ElementsAre("GainRaw = 3", "ExposureTimeAbs = 1234 (asked: 1234.4)", "GainRaw = 7",
                                         "TriggerMode = Off", "PixelFormat = BayerRG8", "Width = 128", "Height = 96",
                                         HasSubstr("frame_rate_hz = 60.0024"), "exposure_us = 2500"));
  EXPECT_THAT(info.warnings, IsEmpty());
  EXPECT_EQ(info.shape.width, 128);
  EXPECT_EQ(info.shape.height, 96);
  EXPECT_EQ(info.format, PixelFormat::kBayerRG8);
  EXPECT_NEAR(info.exposure_s, 2500e-6, 1e-9);
  Frame one;
  ASSERT_NO_FATAL_FAILURE(frame(one));
  EXPECT_EQ(one.width, 128);
  EXPECT_EQ(one.stride, 128);
  EXPECT_EQ(one.size, 128U * 96);
  EXPECT_EQ(one.info.exposure_s, info.exposure_s);
  camera_->recycle(one);
}

TEST_F(AravisCameraTest, ATriggerSetBeforeTheRateStays) {
  fake();
  options_.frameRate_Hz = 60;
  options_.features = {{"TriggerSelector", std::string("FrameStart")},
                       {"TriggerSource", std::string("Software")},
                       {"TriggerMode", std::string("On")}};
  ASSERT_NO_FATAL_FAILURE(open());
  EXPECT_EQ(fake_->read(ARV_FAKE_CAMERA_REGISTER_TRIGGER_MODE), 1U);
  EXPECT_FALSE(camera_->info()->packetSizeVerified) << "nothing has come yet";
}

struct Refusal {
  const char* name;
  Feature feature;
  const char* says;
  friend std::ostream& operator<<(std::ostream& out, const Refusal& refusal) { return out << refusal.name; }
};
class AravisCameraRefusals : public AravisCameraTest, public testing::WithParamInterface<Refusal> {};

TEST_P(AravisCameraRefusals, AreNamed) {
  fake();
  options_.features = {{"GainRaw", std::int64_t{3}}, GetParam().feature};
  const Error error = openFails();
  EXPECT_EQ(error.exitCode, EX_CONFIG);
  EXPECT_THAT(error.message(), HasSubstr(GetParam().feature.name));
  EXPECT_THAT(error.message(), HasSubstr(GetParam().says));
}

INSTANTIATE_TEST_SUITE_P(
    Kinds, AravisCameraRefusals,
    testing::Values(Refusal{"Missing", {"ExposureTme", 5000.0}, "no feature ExposureTme"},
                    Refusal{"NotANumber", {"GainRaw", std::string("high")}, "whole number"},
                    Refusal{"NotWhole", {"GainRaw", 1.5}, "whole number"},
                    Refusal{"TooLarge", {"Width", std::int64_t{1} << 30}, "it may be 1 to 2048"},
                    Refusal{"TooShort", {"AcquisitionFrameRate", -1.0}, "it may be"},
                    Refusal{"NoEntry", {"TriggerMode", std::string("Perhaps")}, "it is one of Off, On"},
                    Refusal{"NoEntryButANumber", {"TriggerMode", std::int64_t{1}}, "it is one of Off, On"},
                    Refusal{"Command", {"TriggerSoftware", std::int64_t{1}}, "write TriggerSoftware = true"},
                    Refusal{"ReadOnly", {"SensorWidth", std::int64_t{640}}, "can only be read"}),
    [](const auto& kind) { return kind.param.name; });

TEST_F(AravisCameraTest, ChoosesAFormatWhereItsOwnCannotBeRead) {
  fake(FakeCamera::Options{.format = ARV_PIXEL_FORMAT_RGB_8_PLANAR});
  ASSERT_NO_FATAL_FAILURE(open());
  EXPECT_TRUE(traitsOf(camera_->info()->format).isBayer()) << "the fewest bytes with colours";
  EXPECT_THAT(camera_->info()->settings, Contains(HasSubstr("8 (chosen")));
}

TEST_F(AravisCameraTest, NamesWhatTheCameraOffersInsteadOfAFormat) {
  fake();
  options_.pixelFormat = "BGR8";
  const Error error = openFails();
  EXPECT_EQ(error.exitCode, EX_CONFIG);
  EXPECT_THAT(error.message(), HasSubstr("BGR8"));
  EXPECT_THAT(error.message(), HasSubstr("it offers"));
  EXPECT_THAT(error.message(), HasSubstr("BayerGB8"));
}

struct Wire {
  const char* name;
  std::uint32_t code;
  PixelFormat format;
  int bytesPerPixel;
  friend std::ostream& operator<<(std::ostream& out, const Wire& wire) { return out << wire.name; }
};
class AravisCameraFormats : public AravisCameraTest, public testing::WithParamInterface<Wire> {};

TEST_P(AravisCameraFormats, ArriveAsTheyAre) {
  fake(FakeCamera::Options{.format = GetParam().code});
  ASSERT_NO_FATAL_FAILURE(open());
  EXPECT_EQ(camera_->info()->format, GetParam().format);
  Frame one;
  ASSERT_NO_FATAL_FAILURE(frame(one));
  EXPECT_EQ(one.format, GetParam().format);
  EXPECT_EQ(one.stride, 64 * GetParam().bytesPerPixel);
  EXPECT_EQ(one.size, static_cast<std::size_t>(one.stride) * 48);
  EXPECT_GT(painted(one), 0U);
  camera_->recycle(one);
  stream(3);
}

INSTANTIATE_TEST_SUITE_P(All, AravisCameraFormats,
                         testing::Values(Wire{"Mono8", ARV_PIXEL_FORMAT_MONO_8, PixelFormat::kMono8, 1},
                                         Wire{"Mono16", ARV_PIXEL_FORMAT_MONO_16, PixelFormat::kMono16, 2},
                                         Wire{"RGB8", ARV_PIXEL_FORMAT_RGB_8_PACKED, PixelFormat::kRgb8, 3},
                                         Wire{"BGR8", ARV_PIXEL_FORMAT_BGR_8_PACKED, PixelFormat::kBgr8, 3},
                                         Wire{"BayerRG8", ARV_PIXEL_FORMAT_BAYER_RG_8, PixelFormat::kBayerRG8, 1},
                                         Wire{"BayerGR8", ARV_PIXEL_FORMAT_BAYER_GR_8, PixelFormat::kBayerGR8, 1},
                                         Wire{"BayerGB8", ARV_PIXEL_FORMAT_BAYER_GB_8, PixelFormat::kBayerGB8, 1},
                                         Wire{"BayerBG8", ARV_PIXEL_FORMAT_BAYER_BG_8, PixelFormat::kBayerBG8, 1}),
                         [](const auto& kind) { return kind.param.name; });

// ---------------------------------------------------------------- network

TEST_F(AravisCameraTest, NegotiatesAndProvesThePacketSize) {
  fake();
  ASSERT_NO_FATAL_FAILURE(open());
  EXPECT_EQ(camera_->info()->packetSize_bytes, 9000);
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
  EXPECT_EQ(camera_->info()->packetSize_bytes, 1500);
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
  EXPECT_EQ(camera_->info()->packetSize_bytes, 1500);
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

// ---------------------------------------------------------------- the stream

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

// ---------------------------------------------------------------- death and return

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
