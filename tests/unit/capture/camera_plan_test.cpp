#include "daemon/capture/camera_plan.h"
#include "tests/unit/capture/quirky.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <fstream>

namespace tractiond::capture::camera_plan_test {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

class CameraPlanTest : public testing::Test {
 protected:
  ~CameraPlanTest() override { std::remove(path_.c_str()); }
  tl::expected<CameraPlan, Error> plan(const std::string& xml, const CameraOptions& options = {}) {
    std::ofstream(path_) << xml;
    return planCamera(path_, options);
  }
  static void replace(std::string& text, const std::string& what, const std::string& by) {
    const auto at = text.find(what);
    ASSERT_NE(at, std::string::npos) << what;
    text.replace(at, what.size(), by);
  }

  std::string path_ = testing::TempDir() + "plan-" + std::to_string(getpid()) + ".xml";
};

TEST_F(CameraPlanTest, SaysWhatWouldBeDone) {
  const auto planned = plan(quirky(), {.frameRate_Hz = 0, .exposure_us = 200, .chunks = {}});
  ASSERT_TRUE(planned) << planned.error().message();
  EXPECT_EQ(planned->vendor, "Tractiond");
  EXPECT_EQ(planned->model, "Quirky");
  EXPECT_EQ(planned->format, "") << "the camera's own";
  EXPECT_THAT(planned->formats, ElementsAre("BayerRG8", "RGB8", "Mono8")) << "the fewest bytes of those with colours";
  EXPECT_EQ(planned->rate, "none");
  EXPECT_EQ(planned->exposure, "ExposureTime");
  EXPECT_EQ(planned->gain, "Gain");
  EXPECT_EQ(planned->chunks, "ChunkExposureTime, ChunkGain, ChunkTimestamp, ChunkFrameID, ChunkLineStatusAll");
  EXPECT_THAT(planned->settings, Contains("exposure_us = 200"));
  EXPECT_THAT(planned->notes, Contains(HasSubstr("ChunkFrameCounter is computed")));
}

TEST_F(CameraPlanTest, AnExposureInMillisecondsIsOne) {
  std::string xml = quirky();
  replace(xml, "<Max>1000000</Max><Unit>us</Unit>", "<Max>1000000</Max><Unit>ms</Unit>");
  replace(xml, "<Min>10</Min>", "<Min>0.01</Min>");
  replace(xml, "FROM / 10", "FROM * 100");
  replace(xml, "TO * 10", "TO / 100.0");
  const auto planned = plan(xml, {.exposure_us = 2500});
  ASSERT_TRUE(planned) << planned.error().message();
  EXPECT_THAT(planned->settings, Contains("exposure_us = 2500"));
}

struct Refusal {
  const char* name;
  Feature feature;
  const char* says;
};
class CameraPlanRefusals : public CameraPlanTest, public testing::WithParamInterface<Refusal> {};

TEST_P(CameraPlanRefusals, AreNamed) {
  const auto planned = plan(quirky(), {.features = {GetParam().feature}});
  ASSERT_FALSE(planned);
  EXPECT_EQ(planned.error().exitCode, EX_CONFIG);
  EXPECT_THAT(planned.error().message(), HasSubstr(GetParam().feature.name));
  EXPECT_THAT(planned.error().message(), HasSubstr(GetParam().says));
}

INSTANTIATE_TEST_SUITE_P(
    Kinds, CameraPlanRefusals,
    testing::Values(Refusal{"Missing", {"ExposureTme", 5000.0}, "no feature ExposureTme"},
                    Refusal{"NotANumber", {"ExposureTime", std::string("long")}, "it is a number"},
                    Refusal{"NotWhole", {"BalanceRatio", 1.5}, "whole number"},
                    Refusal{"TooLarge", {"BalanceRatio", std::int64_t{5000}}, "it may be 0 to 4095"},
                    Refusal{"TooShort", {"ExposureTime", -1.0}, "it may be 10 to 1000000"},
                    Refusal{"NoEntry", {"UserSetSelector", std::string("Perhaps")}, "it is one of Default, UserSet1"},
                    Refusal{"Command", {"UserSetLoad", std::int64_t{1}}, "write UserSetLoad = true"},
                    Refusal{"ReadOnly", {"DeviceModelName", std::string("Another")}, "can only be read"}),
    [](const auto& kind) { return kind.param.name; });

TEST_F(CameraPlanTest, AFormatIsOneOfTheFilesOrIsRefused) {
  const auto planned = plan(quirky(), {.pixelFormat = "Mono8"});
  ASSERT_TRUE(planned) << planned.error().message();
  EXPECT_EQ(planned->format, "Mono8");
  EXPECT_THAT(planned->settings, Contains("PixelFormat = Mono8"));
  const auto refused = plan(quirky(), {.pixelFormat = "Mono12"});
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message(), HasSubstr("it offers BayerRG8, RGB8, Mono8"));
}

/// What registers of 0 say of a format, and of what is available, is no camera's word.
TEST_F(CameraPlanTest, FormatsAreTheFilesWhateverRegistersSay) {
  std::string xml = quirky();
  replace(xml, "<EnumEntry Name=\"BayerRG8\">", "<EnumEntry Name=\"BayerRG8\"><pIsAvailable>GainReg</pIsAvailable>");
  replace(xml, "<EnumEntry Name=\"RGB8Packed\"><Value>35127316</Value>", "<EnumEntry Name=\"Depth\"><Value>7</Value>");
  const auto planned = plan(xml);
  ASSERT_TRUE(planned) << planned.error().message();
  EXPECT_THAT(planned->formats, ElementsAre("BayerRG8", "Mono8"));
  EXPECT_THAT(planned->notes, Contains("formats that cannot be read: Depth (0x00000007)"));
}

TEST_F(CameraPlanTest, ACameraOfForeignFormatsIsRefusedWithTheirCodes) {
  std::string xml = quirky();
  replace(xml, "17301505", "8");
  replace(xml, "17301513", "12");
  replace(xml, "35127316", "16");
  const auto foreign = plan(xml);
  ASSERT_FALSE(foreign);
  EXPECT_EQ(foreign.error().exitCode, EX_CONFIG);
  EXPECT_THAT(foreign.error().message(),
              HasSubstr("RGB8Packed (0x00000010), BayerRG8 (0x0000000C), Mono8 (0x00000008)"));
  replace(xml, "<Enumeration Name=\"PixelFormat\">", "<Enumeration Name=\"Else\">");
  EXPECT_THAT(plan(xml).error().message(), HasSubstr("it has no PixelFormat"));
}

TEST_F(CameraPlanTest, ADescriptionCutShortIsRefusedWhereverTheCutIs) {
  std::string xml = quirky();
  xml.erase(xml.find_last_of('>') + 1);
  for (std::size_t length = 0; length < xml.size(); length += length < xml.size() - 50 ? 97 : 1) {
    const auto planned = plan(xml.substr(0, length));
    ASSERT_FALSE(planned) << length << " of " << xml.size() << " bytes";
    EXPECT_EQ(planned.error().exitCode, EX_DATAERR);
  }
  EXPECT_TRUE(plan(xml + std::string(512, '\0'))) << "some cameras fill up their last page";
}

}  // namespace
}  // namespace tractiond::capture::camera_plan_test
