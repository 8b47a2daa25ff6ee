#include "daemon/records/pixel_format.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cstdint>
#include <limits>

namespace tractiond {

namespace {

// clang-format off
constexpr std::array<PixelFormatTraits, 56> kFormats{{
    {PixelFormat::kMono8, "Mono8", PixelColours::kMono, 8, 8, PixelPacking::kWhole},
    {PixelFormat::kMono10, "Mono10", PixelColours::kMono, 10, 16, PixelPacking::kWhole},
    {PixelFormat::kMono10p, "Mono10p", PixelColours::kMono, 10, 10, PixelPacking::kStream},
    {PixelFormat::kMono10Packed, "Mono10Packed", PixelColours::kMono, 10, 12, PixelPacking::kTriple},
    {PixelFormat::kMono12, "Mono12", PixelColours::kMono, 12, 16, PixelPacking::kWhole},
    {PixelFormat::kMono12p, "Mono12p", PixelColours::kMono, 12, 12, PixelPacking::kStream},
    {PixelFormat::kMono12Packed, "Mono12Packed", PixelColours::kMono, 12, 12, PixelPacking::kTriple},
    {PixelFormat::kMono14, "Mono14", PixelColours::kMono, 14, 16, PixelPacking::kWhole},
    {PixelFormat::kMono14p, "Mono14p", PixelColours::kMono, 14, 14, PixelPacking::kStream},
    {PixelFormat::kMono16, "Mono16", PixelColours::kMono, 16, 16, PixelPacking::kWhole},
    {PixelFormat::kBayerRG8, "BayerRG8", PixelColours::kBayerRG, 8, 8, PixelPacking::kWhole},
    {PixelFormat::kBayerGR8, "BayerGR8", PixelColours::kBayerGR, 8, 8, PixelPacking::kWhole},
    {PixelFormat::kBayerGB8, "BayerGB8", PixelColours::kBayerGB, 8, 8, PixelPacking::kWhole},
    {PixelFormat::kBayerBG8, "BayerBG8", PixelColours::kBayerBG, 8, 8, PixelPacking::kWhole},
    {PixelFormat::kBayerRG10, "BayerRG10", PixelColours::kBayerRG, 10, 16, PixelPacking::kWhole},
    {PixelFormat::kBayerGR10, "BayerGR10", PixelColours::kBayerGR, 10, 16, PixelPacking::kWhole},
    {PixelFormat::kBayerGB10, "BayerGB10", PixelColours::kBayerGB, 10, 16, PixelPacking::kWhole},
    {PixelFormat::kBayerBG10, "BayerBG10", PixelColours::kBayerBG, 10, 16, PixelPacking::kWhole},
    {PixelFormat::kBayerRG10p, "BayerRG10p", PixelColours::kBayerRG, 10, 10, PixelPacking::kStream},
    {PixelFormat::kBayerGR10p, "BayerGR10p", PixelColours::kBayerGR, 10, 10, PixelPacking::kStream},
    {PixelFormat::kBayerGB10p, "BayerGB10p", PixelColours::kBayerGB, 10, 10, PixelPacking::kStream},
    {PixelFormat::kBayerBG10p, "BayerBG10p", PixelColours::kBayerBG, 10, 10, PixelPacking::kStream},
    {PixelFormat::kBayerRG10Packed, "BayerRG10Packed", PixelColours::kBayerRG, 10, 12, PixelPacking::kTriple},
    {PixelFormat::kBayerGR10Packed, "BayerGR10Packed", PixelColours::kBayerGR, 10, 12, PixelPacking::kTriple},
    {PixelFormat::kBayerGB10Packed, "BayerGB10Packed", PixelColours::kBayerGB, 10, 12, PixelPacking::kTriple},
    {PixelFormat::kBayerBG10Packed, "BayerBG10Packed", PixelColours::kBayerBG, 10, 12, PixelPacking::kTriple},
    {PixelFormat::kBayerRG12, "BayerRG12", PixelColours::kBayerRG, 12, 16, PixelPacking::kWhole},
    {PixelFormat::kBayerGR12, "BayerGR12", PixelColours::kBayerGR, 12, 16, PixelPacking::kWhole},
    {PixelFormat::kBayerGB12, "BayerGB12", PixelColours::kBayerGB, 12, 16, PixelPacking::kWhole},
    {PixelFormat::kBayerBG12, "BayerBG12", PixelColours::kBayerBG, 12, 16, PixelPacking::kWhole},
    {PixelFormat::kBayerRG12p, "BayerRG12p", PixelColours::kBayerRG, 12, 12, PixelPacking::kStream},
    {PixelFormat::kBayerGR12p, "BayerGR12p", PixelColours::kBayerGR, 12, 12, PixelPacking::kStream},
    {PixelFormat::kBayerGB12p, "BayerGB12p", PixelColours::kBayerGB, 12, 12, PixelPacking::kStream},
    {PixelFormat::kBayerBG12p, "BayerBG12p", PixelColours::kBayerBG, 12, 12, PixelPacking::kStream},
    {PixelFormat::kBayerRG12Packed, "BayerRG12Packed", PixelColours::kBayerRG, 12, 12, PixelPacking::kTriple},
    {PixelFormat::kBayerGR12Packed, "BayerGR12Packed", PixelColours::kBayerGR, 12, 12, PixelPacking::kTriple},
    {PixelFormat::kBayerGB12Packed, "BayerGB12Packed", PixelColours::kBayerGB, 12, 12, PixelPacking::kTriple},
    {PixelFormat::kBayerBG12Packed, "BayerBG12Packed", PixelColours::kBayerBG, 12, 12, PixelPacking::kTriple},
    {PixelFormat::kBayerRG16, "BayerRG16", PixelColours::kBayerRG, 16, 16, PixelPacking::kWhole},
    {PixelFormat::kBayerGR16, "BayerGR16", PixelColours::kBayerGR, 16, 16, PixelPacking::kWhole},
    {PixelFormat::kBayerGB16, "BayerGB16", PixelColours::kBayerGB, 16, 16, PixelPacking::kWhole},
    {PixelFormat::kBayerBG16, "BayerBG16", PixelColours::kBayerBG, 16, 16, PixelPacking::kWhole},
    {PixelFormat::kRgb8, "RGB8", PixelColours::kRgb, 8, 24, PixelPacking::kWhole},
    {PixelFormat::kBgr8, "BGR8", PixelColours::kBgr, 8, 24, PixelPacking::kWhole},
    {PixelFormat::kRgb10, "RGB10", PixelColours::kRgb, 10, 48, PixelPacking::kWhole},
    {PixelFormat::kBgr10, "BGR10", PixelColours::kBgr, 10, 48, PixelPacking::kWhole},
    {PixelFormat::kRgb10p, "RGB10p", PixelColours::kRgb, 10, 30, PixelPacking::kStream},
    {PixelFormat::kBgr10p, "BGR10p", PixelColours::kBgr, 10, 30, PixelPacking::kStream},
    {PixelFormat::kRgb12, "RGB12", PixelColours::kRgb, 12, 48, PixelPacking::kWhole},
    {PixelFormat::kBgr12, "BGR12", PixelColours::kBgr, 12, 48, PixelPacking::kWhole},
    {PixelFormat::kRgb12p, "RGB12p", PixelColours::kRgb, 12, 36, PixelPacking::kStream},
    {PixelFormat::kBgr12p, "BGR12p", PixelColours::kBgr, 12, 36, PixelPacking::kStream},
    {PixelFormat::kRgb16, "RGB16", PixelColours::kRgb, 16, 48, PixelPacking::kWhole},
    {PixelFormat::kBgr16, "BGR16", PixelColours::kBgr, 16, 48, PixelPacking::kWhole},
    {PixelFormat::kYuv422_8, "YUV422_8", PixelColours::kYuyv, 8, 16, PixelPacking::kWhole},
    {PixelFormat::kYuv422_8_UYVY, "YUV422_8_UYVY", PixelColours::kUyvy, 8, 16, PixelPacking::kWhole},
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

std::vector<std::string> pixelFormatNames() {
  std::vector<std::string> names;
  for (const PixelFormatTraits& format : kFormats) names.emplace_back(format.name);
  return names;
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
