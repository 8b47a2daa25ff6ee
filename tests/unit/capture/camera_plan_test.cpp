#include "daemon/capture/camera_plan.h"
#include "tests/support/places.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <fstream>
#include <iterator>

namespace tractiond::capture::camera_plan_test {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

std::string quirky() {
  std::ifstream file(test::source("tests/unit/capture/descriptions/quirky.xml"));
  return {std::istreambuf_iterator<char>(file), {}};
}

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

TEST_F(CameraPlanTest, RefusalsAreTheCameras) {
  const auto planned = plan(quirky(), {.features = {{"BalanceRatio", std::int64_t{5000}}}});
  ASSERT_FALSE(planned);
  EXPECT_EQ(planned.error().exitCode, EX_CONFIG);
  EXPECT_THAT(planned.error().message(), HasSubstr("it may be 0 to 4095"));
}

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

/// The description with everything in a group in a group, as some makers sort theirs.
std::string grouped(std::string xml) {
  xml.insert(xml.find('>', xml.find("<RegisterDescription")) + 1, "<Group Comment=\"all\"><Group>");
  xml.insert(xml.find("</RegisterDescription"), "</Group></Group>");
  return xml;
}

TEST_F(CameraPlanTest, GroupsChangeNothing) {
  const auto plain = plan(quirky(), {.exposure_us = 200});
  const auto sorted = plan(grouped(quirky()), {.exposure_us = 200});
  ASSERT_TRUE(plain && sorted);
  EXPECT_EQ(sorted->formats, plain->formats);
  EXPECT_EQ(sorted->settings, plain->settings);
  EXPECT_EQ(sorted->chunks, plain->chunks);
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
