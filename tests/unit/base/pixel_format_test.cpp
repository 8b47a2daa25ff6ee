#include "base/pixel_format.h"

#include <gtest/gtest.h>

#include <limits>
#include <map>
#include <set>

namespace tractiond::pixel_format_test {
namespace {

// The convention builds its codes: bits 16 to 23 are the bits that a pixel takes, the highest byte says mono or mosaic
// (1) or several components (2).
TEST(PixelFormat, CodesAgreeWithWhatTheyAreMadeOf) {
  std::set<std::uint32_t> codes;
  std::set<std::string_view> names;
  for (const PixelFormatTraits& format : pixelFormats()) {
    SCOPED_TRACE(format.name);
    EXPECT_TRUE(codes.insert(format.code()).second);
    EXPECT_TRUE(names.insert(format.name).second);
    EXPECT_EQ(static_cast<int>(format.code() >> 16 & 0xff), format.bitsPerPixel);
    EXPECT_EQ(format.code() >> 24, format.colours == PixelColours::kMono || format.isBayer() ? 1U : 2U);
    EXPECT_EQ(pixelFormatByCode(format.code()), &format);
    EXPECT_EQ(pixelFormatByName(format.name), &format);
    EXPECT_EQ(&traitsOf(format.format), &format);
  }
  EXPECT_EQ(pixelFormatByCode(0x01080002), nullptr);  // Mono8s, signed
  EXPECT_EQ(pixelFormatByName("RGB8Packed"), nullptr);
}

// Of the standard's list (GenICam Pixel Format Values), by hand: a slip that keeps the two rules above.
TEST(PixelFormat, HasTheCodesOfTheStandard) {
  const std::map<std::string_view, std::uint32_t> standard = {
      {"Mono8", 0x01080001},        {"Mono10Packed", 0x010C0004},
      {"Mono12", 0x01100005},       {"Mono12Packed", 0x010C0006},
      {"Mono16", 0x01100007},       {"Mono10p", 0x010A0046},
      {"Mono12p", 0x010C0047},      {"BayerGR8", 0x01080008},
      {"BayerRG8", 0x01080009},     {"BayerGB8", 0x0108000A},
      {"BayerBG8", 0x0108000B},     {"BayerRG12", 0x01100011},
      {"BayerRG12p", 0x010C0059},   {"BayerRG12Packed", 0x010C002B},
      {"BayerBG10p", 0x010A0052},   {"RGB8", 0x02180014},
      {"BGR8", 0x02180015},         {"RGB12", 0x0230001A},
      {"RGB12p", 0x0224005D},       {"YUV422_8", 0x02100032},
      {"YUV422_8_UYVY", 0x0210001F}};
  for (const auto& [name, code] : standard) EXPECT_EQ(pixelFormatByName(name)->code(), code) << name;
}

TEST(PixelFormat, SizesArePackedWithoutGaps) {
  const auto format = [](std::string_view name) -> const PixelFormatTraits& { return *pixelFormatByName(name); };
  EXPECT_EQ(format("Mono8").size(641, 3), 1923U);
  EXPECT_EQ(format("Mono12").size(641, 3), 3846U);
  EXPECT_EQ(format("Mono12p").size(641, 3), 2885U);  // 2884.5
  EXPECT_EQ(format("Mono10p").size(640, 480), 384000U);
  EXPECT_EQ(format("Mono10Packed").size(640, 480), 460800U);
  EXPECT_EQ(format("RGB8").size(640, 480), 921600U);
  EXPECT_EQ(format("RGB10p").size(3, 1), 12U);  // 11.25
  EXPECT_EQ(format("YUV422_8").size(640, 480), 614400U);
  EXPECT_EQ(format("Mono8").stride(641), 641);
  EXPECT_EQ(format("Mono12p").stride(640), 960);
  EXPECT_EQ(format("Mono12p").stride(641), 0);
  EXPECT_EQ(format("Mono12Packed").stride(642), 963);
  EXPECT_EQ(format("Mono12Packed").stride(641), 0);
  EXPECT_EQ(format("Mono10p").stride(642), 0);
  EXPECT_EQ(format("RGB16").stride(5), 30);
  EXPECT_EQ(format("RGB8").stride(std::numeric_limits<int>::max()), 0) << "as a forged picture may state it";
}

}  // namespace
}  // namespace tractiond::pixel_format_test
