// Cameras whose descriptions would end whoever evaluates them: they are refused, and the process goes on.
#include "daemon/capture/aravis_driver.h"
#include "daemon/capture/camera_list.h"
#include "daemon/capture/inspection.h"
#include "tests/support/places.h"
#include "tests/unit/capture/quirks.h"
#include "tests/unit/capture/quirky.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include <cstdio>
#include <fstream>

namespace tractiond::capture::hostile_camera_test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

/// The same with more in it.
std::string with(const std::string& nodes) {
  std::string xml = quirky();
  xml.insert(xml.find("</RegisterDescription>"), nodes);
  return xml;
}

std::string knife(const std::string& name, const std::string& of) {
  return "<IntSwissKnife Name=\"" + name + "\"><pVariable Name=\"A\">" + of + "</pVariable><pVariable Name=\"B\">" +
         of + "</pVariable><Formula>A + B</Formula></IntSwissKnife>";
}

class HostileCamera : public testing::Test {
 protected:
  ~HostileCamera() override { std::remove(file_.c_str()); }

  /// At 127.0.0.1 until the test ends.
  test::GvTransmitter& serve(const std::string& xml) {
    std::ofstream(file_) << xml;
    camera_.reset();
    camera_ = std::make_unique<test::GvTransmitter>(file_);
    return *camera_;
  }
  Error open() {
    const auto driver = fromAravis(options_)({});
    return driver ? Error{.exitCode = EX_OK} : driver.error();
  }
  void expectRefused(const testing::Matcher<std::string>& why) {
    const Error error = open();
    EXPECT_EQ(error.exitCode, EX_UNAVAILABLE) << "worth another try";
    EXPECT_THAT(error.message(), why);
  }

  std::string file_ = testing::TempDir() + "hostile-" + std::to_string(getpid()) + ".xml";
  std::unique_ptr<test::GvTransmitter> camera_;
  CameraOptions options_{.id = "127.0.0.1", .inspector = test::built("bin/tractiond")};
};

TEST_F(HostileCamera, OneWithoutMaliceIsOpened) {
  Inspection inspection = inspectInChild("127.0.0.1", {.program = options_.inspector});
  EXPECT_EQ(inspection.outcome, Inspection::Outcome::kAbsent) << inspection.text;
  serve(quirky());
  inspection = inspectInChild("127.0.0.1", {.program = options_.inspector});
  EXPECT_EQ(inspection.outcome, Inspection::Outcome::kHarmless) << inspection.text;
}

TEST_F(HostileCamera, ValuesThatDependOnThemselvesAreRefused) {
  serve(with("<Group>" + knife("One", "Two") + knife("Two", "One") + "</Group>"));
  expectRefused(HasSubstr("crashes what evaluates it"));
}

/// It answers, and is not silent: in the list, too.
TEST_F(HostileCamera, ADescriptionThatCannotBeReadIsTold) {
  constexpr const char* kTold = "the camera answers, but its description cannot be read";
  for (const std::string xml : {"<!DOCTYPE html><html><body>Busy</body></html>", " \n", "<Camera></Camera>"}) {
    serve(xml);
    expectRefused(AllOf(HasSubstr(kTold), Not(HasSubstr("does not answer"))));
    const auto sights = inspectCameras(options_.inspector, false);
    ASSERT_EQ(sights.size(), 1U);
    EXPECT_THAT(sights[0].obstacle, HasSubstr(kTold));
  }
}

/// It would send one picture, and be lost for its silence again and again.
TEST_F(HostileCamera, OneThatStaysInAnotherAcquisitionModeIsRefused) {
  std::string xml = quirky();
  const std::string other = "<EnumEntry Name=\"SingleFrame\"><Value>0</Value></EnumEntry>";
  xml.insert(xml.find("</Enumeration>", xml.find("Name=\"AcquisitionMode\"")), other);
  test::GvTransmitter& camera = serve(xml);
  camera.write(0x12c, 0);  // AcquisitionModeReg
  camera.locksAt = 0x12c;
  camera.write(0x100, kWidth);
  camera.write(0x104, kHeight);
  camera.write(0x128, kRgb8Code);
  const Error error = open();
  EXPECT_EQ(error.exitCode, EX_CONFIG);
  EXPECT_THAT(error.message(), AllOf(HasSubstr("refuses AcquisitionMode = Continuous"), HasSubstr("SingleFrame")));
}

TEST_F(HostileCamera, WhatToCheckIsToldWhereNoneAnswers) {
  for (const char* id : {"", "Maker-1234"}) {
    options_.id = id;
    expectRefused(AllOf(HasSubstr("no camera answers"), HasSubstr("UDP port 3956")));
  }
}

TEST_F(HostileCamera, OneInAnotherNetworkIsToldSo) {
  options_.id = "192.0.2.7";
  expectRefused(AllOf(HasSubstr("192.0.2.7 is in no network of this host"), HasSubstr("arv-tool-0.8 network")));
}

}  // namespace
}  // namespace tractiond::capture::hostile_camera_test
