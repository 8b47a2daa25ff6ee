// Setting the camera: features, trigger, pixel formats, and what it refuses.
#include "tests/unit/capture/aravis_camera_bench.h"

namespace tractiond::capture::aravis_camera_test {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

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

}  // namespace
}  // namespace tractiond::capture::aravis_camera_test
