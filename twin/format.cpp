#include "twin/format.h"

#include <algorithm>
#include <cassert>

namespace twin {

namespace {

using Order = FormatTraits::Order;
using Packing = FormatTraits::Packing;

constexpr std::array<Channel, 4> kAlike = {kGreen, kGreen, kGreen, kGreen};
constexpr std::array<Channel, 4> kRG = {kRed, kGreen, kGreen, kBlue}, kGR = {kGreen, kRed, kBlue, kGreen};
constexpr std::array<Channel, 4> kGB = {kGreen, kBlue, kRed, kGreen}, kBG = {kBlue, kGreen, kGreen, kRed};

// clang-format off
constexpr std::array<FormatTraits, kFormatCount> kFormats{{
    {"RGB8", 0x02180014, Order::kRgb, kAlike, 8, 8, Packing::kWhole},
    {"BGR8", 0x02180015, Order::kBgr, kAlike, 8, 8, Packing::kWhole},
    {"BayerRG8", 0x01080009, Order::kMosaic, kRG, 8, 8, Packing::kWhole},
    {"BayerGR8", 0x01080008, Order::kMosaic, kGR, 8, 8, Packing::kWhole},
    {"BayerGB8", 0x0108000A, Order::kMosaic, kGB, 8, 8, Packing::kWhole},
    {"BayerBG8", 0x0108000B, Order::kMosaic, kBG, 8, 8, Packing::kWhole},
    {"Mono8", 0x01080001, Order::kGrey, kAlike, 8, 8, Packing::kWhole},
    {"Mono10", 0x01100003, Order::kGrey, kAlike, 10, 16, Packing::kWhole},
    {"Mono10p", 0x010A0046, Order::kGrey, kAlike, 10, 10, Packing::kStream},
    {"Mono10Packed", 0x010C0004, Order::kGrey, kAlike, 10, 12, Packing::kTriple},
    {"Mono12", 0x01100005, Order::kGrey, kAlike, 12, 16, Packing::kWhole},
    {"Mono12p", 0x010C0047, Order::kGrey, kAlike, 12, 12, Packing::kStream},
    {"Mono12Packed", 0x010C0006, Order::kGrey, kAlike, 12, 12, Packing::kTriple},
    {"Mono16", 0x01100007, Order::kGrey, kAlike, 16, 16, Packing::kWhole},
    {"BayerRG10p", 0x010A0058, Order::kMosaic, kRG, 10, 10, Packing::kStream},
    {"BayerRG12", 0x01100011, Order::kMosaic, kRG, 12, 16, Packing::kWhole},
    {"BayerRG12p", 0x010C0059, Order::kMosaic, kRG, 12, 12, Packing::kStream},
    {"BayerRG12Packed", 0x010C002B, Order::kMosaic, kRG, 12, 12, Packing::kTriple},
    {"BayerGR12p", 0x010C0057, Order::kMosaic, kGR, 12, 12, Packing::kStream},
    {"BayerGB16", 0x01100030, Order::kMosaic, kGB, 16, 16, Packing::kWhole},
    {"RGB10p", 0x021E005C, Order::kRgb, kAlike, 10, 10, Packing::kStream},
    {"RGB12", 0x0230001A, Order::kRgb, kAlike, 12, 16, Packing::kWhole},
    {"RGB16", 0x02300033, Order::kRgb, kAlike, 16, 16, Packing::kWhole},
    {"BGR12p", 0x02240049, Order::kBgr, kAlike, 12, 12, Packing::kStream},
}};
// clang-format on

template <typename Is>
std::optional<Format> find(Is is) {
  const auto* found = std::find_if(kFormats.begin(), kFormats.end(), is);
  if (found == kFormats.end()) return std::nullopt;
  return static_cast<Format>(found - kFormats.begin());
}

}  // namespace

const FormatTraits& traitsOf(Format format) {
  return kFormats[static_cast<std::size_t>(format)];
}

std::string formatNames() {
  std::string names;
  for (const FormatTraits& format : kFormats) names += std::string(names.empty() ? "" : ", ") + format.name;
  return names;
}

std::optional<Format> formatByName(const std::string& name) {
  return find([&](const FormatTraits& traits) { return name == traits.name; });
}

std::optional<Format> formatByCode(std::uint32_t code) {
  return find([&](const FormatTraits& traits) { return code == traits.code; });
}

bool isBayer(Format format) {
  return traitsOf(format).order == Order::kMosaic;
}

std::size_t samplesPerPixel(Format format) {
  const Order order = traitsOf(format).order;
  return order == Order::kRgb || order == Order::kBgr ? 3 : 1;
}

std::size_t pictureSize(Format format, int width, int height) {
  const std::size_t samples =
      samplesPerPixel(format) * static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  return (samples * static_cast<std::size_t>(traitsOf(format).bitsPerSample) + 7) / 8;
}

void pack(Format format, std::span<const std::uint16_t> samples, std::span<std::uint8_t> bytes) {
  const FormatTraits& traits = traitsOf(format);
  assert(traits.bits > 8);
  if (traits.packing == Packing::kTriple) {
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
  std::uint32_t waiting = 0;
  int bits = 0;
  std::uint8_t* to = bytes.data();
  for (const std::uint16_t sample : samples) {
    waiting |= std::uint32_t{sample} << bits;
    bits += traits.bitsPerSample;
    for (; bits >= 8; bits -= 8, waiting >>= 8) *to++ = static_cast<std::uint8_t>(waiting);
  }
  if (bits > 0) *to = static_cast<std::uint8_t>(waiting);
}

}  // namespace twin
