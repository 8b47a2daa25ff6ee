// Pixel formats of the twin's camera, named by the GenICam pixel format naming convention.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
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

/// Colour channels. A grey picture has only the second.
enum Channel : std::size_t { kRed, kGreen, kBlue };

/// Layout of a format in memory. Pixels are in rows from the top, without padding.
struct FormatTraits {
  enum class Order { kGrey, kMosaic, kRgb, kBgr };
  enum class Packing {
    kWhole,   ///< little-endian, whole bytes per sample
    kStream,  ///< a bit stream, the convention's suffix "p"
    kTriple,  ///< two samples in three bytes, GigE Vision's suffix "Packed"
  };

  const char* name;    ///< "RGB8"
  std::uint32_t code;  ///< GenICam code
  Order order;
  std::array<Channel, 4> cell;  ///< channels of a mosaic's 2 x 2 pixels, row by row; kGreen in other formats
  int bits;                     ///< bits of a sample
  int bitsPerSample;            ///< bits per sample in memory
  Packing packing;
};

/// Returns the traits of a format, in static storage.
const FormatTraits& traitsOf(Format format);

/// Returns all names as one text: "RGB8, BGR8, ..."
std::string formatNames();
/// Return the format with this name (exact case) or GenICam code; nothing if there is none.
std::optional<Format> formatByName(const std::string& name);
std::optional<Format> formatByCode(std::uint32_t code);

/// Returns whether the format is a Bayer mosaic.
bool isBayer(Format format);
/// Returns the samples per pixel: 3 for RGB and BGR, else 1.
std::size_t samplesPerPixel(Format format);

/// Returns the size of a picture without padding of its rows [bytes]. \param width, height [px]
std::size_t pictureSize(Format format, int width, int height);

/// Packs samples of more than 8 bits, right-aligned, into the format's bytes. The format must have more than 8 bits
/// (asserted); `bytes` must hold them all.
void pack(Format format, std::span<const std::uint16_t> samples, std::span<std::uint8_t> bytes);

}  // namespace twin
