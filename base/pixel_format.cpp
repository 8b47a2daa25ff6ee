#include "base/pixel_format.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cstdint>
#include <limits>

namespace tractiond {

namespace {

// clang-format off
constexpr std::array<PixelFormatTraits, 56> kFormats{{
    {PixelFormat{0x01080001}, "Mono8", PixelColours::kMono, 8, 8, PixelPacking::kWhole},
    {PixelFormat{0x01100003}, "Mono10", PixelColours::kMono, 10, 16, PixelPacking::kWhole},
    {PixelFormat{0x010A0046}, "Mono10p", PixelColours::kMono, 10, 10, PixelPacking::kStream},
    {PixelFormat{0x010C0004}, "Mono10Packed", PixelColours::kMono, 10, 12, PixelPacking::kTriple},
    {PixelFormat{0x01100005}, "Mono12", PixelColours::kMono, 12, 16, PixelPacking::kWhole},
    {PixelFormat{0x010C0047}, "Mono12p", PixelColours::kMono, 12, 12, PixelPacking::kStream},
    {PixelFormat{0x010C0006}, "Mono12Packed", PixelColours::kMono, 12, 12, PixelPacking::kTriple},
    {PixelFormat{0x01100025}, "Mono14", PixelColours::kMono, 14, 16, PixelPacking::kWhole},
    {PixelFormat{0x010E0104}, "Mono14p", PixelColours::kMono, 14, 14, PixelPacking::kStream},
    {PixelFormat{0x01100007}, "Mono16", PixelColours::kMono, 16, 16, PixelPacking::kWhole},
    {PixelFormat{0x01080009}, "BayerRG8", PixelColours::kBayerRG, 8, 8, PixelPacking::kWhole},
    {PixelFormat{0x01080008}, "BayerGR8", PixelColours::kBayerGR, 8, 8, PixelPacking::kWhole},
    {PixelFormat{0x0108000A}, "BayerGB8", PixelColours::kBayerGB, 8, 8, PixelPacking::kWhole},
    {PixelFormat{0x0108000B}, "BayerBG8", PixelColours::kBayerBG, 8, 8, PixelPacking::kWhole},
    {PixelFormat{0x0110000D}, "BayerRG10", PixelColours::kBayerRG, 10, 16, PixelPacking::kWhole},
    {PixelFormat{0x0110000C}, "BayerGR10", PixelColours::kBayerGR, 10, 16, PixelPacking::kWhole},
    {PixelFormat{0x0110000E}, "BayerGB10", PixelColours::kBayerGB, 10, 16, PixelPacking::kWhole},
    {PixelFormat{0x0110000F}, "BayerBG10", PixelColours::kBayerBG, 10, 16, PixelPacking::kWhole},
    {PixelFormat{0x010A0058}, "BayerRG10p", PixelColours::kBayerRG, 10, 10, PixelPacking::kStream},
    {PixelFormat{0x010A0056}, "BayerGR10p", PixelColours::kBayerGR, 10, 10, PixelPacking::kStream},
    {PixelFormat{0x010A0054}, "BayerGB10p", PixelColours::kBayerGB, 10, 10, PixelPacking::kStream},
    {PixelFormat{0x010A0052}, "BayerBG10p", PixelColours::kBayerBG, 10, 10, PixelPacking::kStream},
    {PixelFormat{0x010C0027}, "BayerRG10Packed", PixelColours::kBayerRG, 10, 12, PixelPacking::kTriple},
    {PixelFormat{0x010C0026}, "BayerGR10Packed", PixelColours::kBayerGR, 10, 12, PixelPacking::kTriple},
    {PixelFormat{0x010C0028}, "BayerGB10Packed", PixelColours::kBayerGB, 10, 12, PixelPacking::kTriple},
    {PixelFormat{0x010C0029}, "BayerBG10Packed", PixelColours::kBayerBG, 10, 12, PixelPacking::kTriple},
    {PixelFormat{0x01100011}, "BayerRG12", PixelColours::kBayerRG, 12, 16, PixelPacking::kWhole},
    {PixelFormat{0x01100010}, "BayerGR12", PixelColours::kBayerGR, 12, 16, PixelPacking::kWhole},
    {PixelFormat{0x01100012}, "BayerGB12", PixelColours::kBayerGB, 12, 16, PixelPacking::kWhole},
    {PixelFormat{0x01100013}, "BayerBG12", PixelColours::kBayerBG, 12, 16, PixelPacking::kWhole},
    {PixelFormat{0x010C0059}, "BayerRG12p", PixelColours::kBayerRG, 12, 12, PixelPacking::kStream},
    {PixelFormat{0x010C0057}, "BayerGR12p", PixelColours::kBayerGR, 12, 12, PixelPacking::kStream},
    {PixelFormat{0x010C0055}, "BayerGB12p", PixelColours::kBayerGB, 12, 12, PixelPacking::kStream},
    {PixelFormat{0x010C0053}, "BayerBG12p", PixelColours::kBayerBG, 12, 12, PixelPacking::kStream},
    {PixelFormat{0x010C002B}, "BayerRG12Packed", PixelColours::kBayerRG, 12, 12, PixelPacking::kTriple},
    {PixelFormat{0x010C002A}, "BayerGR12Packed", PixelColours::kBayerGR, 12, 12, PixelPacking::kTriple},
    {PixelFormat{0x010C002C}, "BayerGB12Packed", PixelColours::kBayerGB, 12, 12, PixelPacking::kTriple},
    {PixelFormat{0x010C002D}, "BayerBG12Packed", PixelColours::kBayerBG, 12, 12, PixelPacking::kTriple},
    {PixelFormat{0x0110002F}, "BayerRG16", PixelColours::kBayerRG, 16, 16, PixelPacking::kWhole},
    {PixelFormat{0x0110002E}, "BayerGR16", PixelColours::kBayerGR, 16, 16, PixelPacking::kWhole},
    {PixelFormat{0x01100030}, "BayerGB16", PixelColours::kBayerGB, 16, 16, PixelPacking::kWhole},
    {PixelFormat{0x01100031}, "BayerBG16", PixelColours::kBayerBG, 16, 16, PixelPacking::kWhole},
    {PixelFormat{0x02180014}, "RGB8", PixelColours::kRgb, 8, 24, PixelPacking::kWhole},
    {PixelFormat{0x02180015}, "BGR8", PixelColours::kBgr, 8, 24, PixelPacking::kWhole},
    {PixelFormat{0x02300018}, "RGB10", PixelColours::kRgb, 10, 48, PixelPacking::kWhole},
    {PixelFormat{0x02300019}, "BGR10", PixelColours::kBgr, 10, 48, PixelPacking::kWhole},
    {PixelFormat{0x021E005C}, "RGB10p", PixelColours::kRgb, 10, 30, PixelPacking::kStream},
    {PixelFormat{0x021E0048}, "BGR10p", PixelColours::kBgr, 10, 30, PixelPacking::kStream},
    {PixelFormat{0x0230001A}, "RGB12", PixelColours::kRgb, 12, 48, PixelPacking::kWhole},
    {PixelFormat{0x0230001B}, "BGR12", PixelColours::kBgr, 12, 48, PixelPacking::kWhole},
    {PixelFormat{0x0224005D}, "RGB12p", PixelColours::kRgb, 12, 36, PixelPacking::kStream},
    {PixelFormat{0x02240049}, "BGR12p", PixelColours::kBgr, 12, 36, PixelPacking::kStream},
    {PixelFormat{0x02300033}, "RGB16", PixelColours::kRgb, 16, 48, PixelPacking::kWhole},
    {PixelFormat{0x0230004B}, "BGR16", PixelColours::kBgr, 16, 48, PixelPacking::kWhole},
    {PixelFormat{0x02100032}, "YUV422_8", PixelColours::kYuyv, 8, 16, PixelPacking::kWhole},
    {PixelFormat{0x0210001F}, "YUV422_8_UYVY", PixelColours::kUyvy, 8, 16, PixelPacking::kWhole},
}};
// clang-format on

}  // namespace

int PixelFormatTraits::stride(int width) const {
  const bool pairs = packing == PixelPacking::kTriple || colours >= PixelColours::kYuyv;
  const std::int64_t rowBits = std::int64_t{width} * bitsPerPixel;
  if (rowBits % 8 != 0 || (pairs && width % 2 != 0) || rowBits / 8 > std::numeric_limits<int>::max()) return 0;
  return static_cast<int>(rowBits / 8);
}

std::span<const PixelFormatTraits> pixelFormats() {
  return kFormats;
}

const PixelFormatTraits& traitsOf(PixelFormat format) {
  const PixelFormatTraits* traits = pixelFormatByCode(static_cast<std::uint32_t>(format));
  assert(traits != nullptr);
  return *traits;
}

const PixelFormatTraits* pixelFormatByCode(std::uint32_t code) {
  const auto* found = std::find_if(kFormats.begin(), kFormats.end(), [&](const auto& f) { return f.code() == code; });
  return found == kFormats.end() ? nullptr : found;
}

const PixelFormatTraits* pixelFormatByName(std::string_view name) {
  const auto* found = std::find_if(kFormats.begin(), kFormats.end(), [&](const auto& f) { return f.name == name; });
  return found == kFormats.end() ? nullptr : found;
}

}  // namespace tractiond
