// The layouts in which the twin's camera sends its pictures, named as in the GenICam pixel format naming convention.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace twin {

enum class Format {
  kRgb8,
  kBgr8,
  kBayerRG8,
  kBayerGR8,
  kBayerGB8,
  kBayerBG8,
  kMono8,
  kMono10,
  kMono10p,
  kMono10Packed,
  kMono12,
  kMono12p,
  kMono12Packed,
  kMono16,
  kBayerRG10p,
  kBayerRG12,
  kBayerRG12p,
  kBayerRG12Packed,
  kBayerGR12p,
  kBayerGB16,
  kRgb10p,
  kRgb12,
  kRgb16,
  kBgr12p,
};
inline constexpr std::size_t kFormatCount = 24;

/// Red, green and blue; a grey picture has the second alone.
enum Channel : std::size_t { kRed, kGreen, kBlue };

struct FormatTraits {
  enum class Order { kGrey, kMosaic, kRgb, kBgr };
  enum class Packing {
    kWhole,   ///< little-endian in whole bytes
    kStream,  ///< the convention's "p"
    kTriple,  ///< GigE Vision's "Packed"
  };

  const char* name;
  std::uint32_t code;  ///< of GenICam
  Order order;
  std::array<Channel, 4> cell;  ///< of a mosaic's two by two pixels
  int bits;                     ///< of a sample
  int bitsPerSample;            ///< in memory
  Packing packing;
};

const FormatTraits& traitsOf(Format format);

/// "RGB8, BGR8, ..."
std::string formatNames();
/// Null: there is none of this name, or code.
const Format* formatByName(const std::string& name);
const Format* formatByCode(std::uint32_t code);

bool isBayer(Format format);
std::size_t samplesPerPixel(Format format);

/// Of a whole picture [bytes].
std::size_t pictureSize(Format format, int width, int height);

/// Samples of more than 8 bits into the format's bytes, as many as the samples fill.
void pack(Format format, std::span<const std::uint16_t> samples, std::span<std::uint8_t> bytes);

}  // namespace twin
