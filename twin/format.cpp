#include "twin/format.h"

#include <algorithm>
#include <cassert>

namespace twin {
namespace {

using tractiond::PixelColours;

constexpr std::array kFormats = {
    Format::kRgb8,      Format::kBgr8,       Format::kBayerRG8,        Format::kBayerGR8,   Format::kBayerGB8,
    Format::kBayerBG8,  Format::kMono8,      Format::kMono10,          Format::kMono10p,    Format::kMono10Packed,
    Format::kMono12,    Format::kMono12p,    Format::kMono12Packed,    Format::kMono16,     Format::kBayerRG10p,
    Format::kBayerRG12, Format::kBayerRG12p, Format::kBayerRG12Packed, Format::kBayerGR12p, Format::kBayerGB16,
    Format::kRgb10p,    Format::kRgb12,      Format::kRgb16,           Format::kBgr12p,
};

}  // namespace

std::span<const Format> formats() {
  return kFormats;
}

std::string formatNames() {
  std::string names;
  for (const Format format : kFormats) names.append(names.empty() ? "" : ", ").append(traitsOf(format).name);
  return names;
}

std::optional<Format> formatByName(const std::string& name) {
  const auto* found = std::ranges::find(kFormats, name, [](Format format) { return traitsOf(format).name; });
  if (found == kFormats.end()) return std::nullopt;
  return *found;
}

std::array<Channel, 4> cellOf(Format format) {
  switch (traitsOf(format).colours) {
  case PixelColours::kBayerRG:
    return {kRed, kGreen, kGreen, kBlue};
  case PixelColours::kBayerGR:
    return {kGreen, kRed, kBlue, kGreen};
  case PixelColours::kBayerGB:
    return {kGreen, kBlue, kRed, kGreen};
  case PixelColours::kBayerBG:
    return {kBlue, kGreen, kGreen, kRed};
  default:
    return {kGreen, kGreen, kGreen, kGreen};
  }
}

std::size_t samplesPerPixel(Format format) {
  const PixelColours colours = traitsOf(format).colours;
  return colours == PixelColours::kRgb || colours == PixelColours::kBgr ? 3 : 1;
}

void pack(Format format, std::span<const std::uint16_t> samples, std::span<std::uint8_t> bytes) {
  const tractiond::PixelFormatTraits& traits = traitsOf(format);
  assert(traits.bits > 8);
  if (traits.packing == tractiond::PixelPacking::kTriple) {
    std::fill(bytes.begin(), bytes.end(), std::uint8_t{0});
    const int shared = traits.bits - 8, mask = (1 << shared) - 1;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      std::uint8_t* const pair = bytes.data() + i / 2 * 3;
      pair[i % 2 * 2] = static_cast<std::uint8_t>(samples[i] >> shared);
      pair[1] = static_cast<std::uint8_t>(pair[1] | (samples[i] & mask) << i % 2 * 4);
    }
    return;
  }
  // Both other packings are bit streams that fill each byte from its lowest bit.
  const int bitsPerSample = traits.bitsPerPixel / static_cast<int>(samplesPerPixel(format));
  std::uint32_t waiting = 0;
  int bits = 0;
  std::uint8_t* to = bytes.data();
  for (const std::uint16_t sample : samples) {
    waiting |= std::uint32_t{sample} << bits;
    bits += bitsPerSample;
    for (; bits >= 8; bits -= 8, waiting >>= 8) *to++ = static_cast<std::uint8_t>(waiting);
  }
  if (bits > 0) *to = static_cast<std::uint8_t>(waiting);
}

}  // namespace twin
