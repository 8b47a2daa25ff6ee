// What people ask of a camera's features, on a camera that is a description.
#include "daemon/capture/aravis.h"
#include "daemon/capture/paper_device.h"
#include "tests/unit/capture/quirky.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

namespace tractiond::capture::camera_query_test {
namespace {

using testing::HasSubstr;

class CameraQuery : public testing::Test {
 protected:
  CameraQuery() {
    Failure failure;
    device_ = makePaperDevice(quirky(), failure);
    if (!device_) throw std::runtime_error(failure.text());
    camera_.reset(arv_camera_new_with_device(device_.get(), failure.into()));
    if (!camera_) throw std::runtime_error(failure.text());
  }
  tl::expected<CameraReport, std::string> ask(const CameraStep& step) {
    return serveFeatures(camera_.get(), step, {}, first_);
  }
  tl::expected<CameraReport, std::string> write(const std::string& name, const std::string& value) {
    CameraStep step;
    step.mutable_write()->set_name(name);
    step.mutable_write()->set_value(value);
    return ask(step);
  }
  static std::string refusal(const tl::expected<CameraReport, std::string>& report) {
    return report ? "done" : report.error();
  }

  Ref<ArvDevice> device_;
  Ref<ArvCamera> camera_;
  std::map<std::string, std::string> first_;
};

/// A message with other text cannot be read by a client.
TEST(CameraText, IsUtf8WhateverTheCameraSays) {
  EXPECT_EQ(text("Kamera \xc2\xb5"), "Kamera \xc2\xb5");
  EXPECT_EQ(text("M\xfcller \xc3"), "M\xef\xbf\xbdller \xef\xbf\xbd");
  EXPECT_EQ(text(nullptr), "");
}

TEST_F(CameraQuery, WritesAndTellsWhatStoodBefore) {
  const auto report = write("ExposureTime", "500");
  ASSERT_TRUE(report) << report.error();
  ASSERT_EQ(report->features_size(), 1);
  EXPECT_EQ(report->features(0).value(), "500");
  EXPECT_EQ(first_.size(), 1U);
  for (const std::string word : {"long", "nan", "inf"})
    EXPECT_THAT(refusal(write("ExposureTime", word)), HasSubstr("refuses ExposureTime = " + word + ": it is a number"));
  EXPECT_THAT(refusal(write("Exposuretime", "500")), HasSubstr("it has ExposureTime"));
  EXPECT_THAT(refusal(write("ExposureTme", "500")), HasSubstr("it has ExposureTime"));
  EXPECT_THAT(refusal(write("Gan", "5")), HasSubstr("Gain"));
}

TEST_F(CameraQuery, ExecutesCommandsAlone) {
  for (const char* feature : {"ExposureTime", "Width"}) {
    CameraStep step;
    step.mutable_execute()->set_name(feature);
    EXPECT_EQ(refusal(ask(step)), std::string(feature) + " is not a command: set it");
  }
}

/// The driver would notice another picture, open the camera again, and put it back without a word.
TEST_F(CameraQuery, DoesNotChangeThePictureThatMarkersAreFollowedIn) {
  for (const char* feature : {"Width", "Height", "OffsetX", "OffsetY", "PixelFormat"})
    EXPECT_THAT(refusal(write(feature, "256")), HasSubstr("set it in [camera] of the configuration")) << feature;
}

TEST_F(CameraQuery, SaysWhatIsMissingForWhiteAndTriggers) {
  CameraStep step;
  step.mutable_balance_white();
  EXPECT_THAT(refusal(ask(step)), HasSubstr("it has no BalanceWhiteAuto; see tractionctl camera list"));
  step.mutable_trigger();
  EXPECT_THAT(refusal(ask(step)), HasSubstr("set camera.trigger = \"software\""));
}

}  // namespace
}  // namespace tractiond::capture::camera_query_test
