// Table of the pixel formats that can be read, by the names and codes of the Pixel Format Naming Convention.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace tractiond {

/// The values are the 32-bit codes that cameras send (GenICam Pixel Format Naming Convention 2.4, and its Pixel Format
/// Values for those that GigE Vision named before it: "...Packed"). Cameras spell names differently (RGB8Packed,
/// YUV422Packed), never the codes. Enumerators are those that code names; all that can be read: pixelFormats().
enum class PixelFormat : std::uint32_t {
  kMono8 = 0x01080001,
  kMono10 = 0x01100003,
  kMono10p = 0x010A0046,
  kMono10Packed = 0x010C0004,
  kMono12 = 0x01100005,
  kMono12p = 0x010C0047,
  kMono12Packed = 0x010C0006,
  kMono16 = 0x01100007,
  kBayerRG8 = 0x01080009,
  kBayerGR8 = 0x01080008,
  kBayerGB8 = 0x0108000A,
  kBayerBG8 = 0x0108000B,
  kBayerRG10p = 0x010A0058,
  kBayerRG12 = 0x01100011,
  kBayerGR12 = 0x01100010,
  kBayerGB12 = 0x01100012,
  kBayerBG12 = 0x01100013,
  kBayerRG12p = 0x010C0059,
  kBayerGR12p = 0x010C0057,
  kBayerRG12Packed = 0x010C002B,
  kBayerGB16 = 0x01100030,
  kRgb8 = 0x02180014,
  kBgr8 = 0x02180015,
  kRgb10p = 0x021E005C,
  kRgb12 = 0x0230001A,
  kBgr12 = 0x0230001B,
  kBgr12p = 0x02240049,
  kRgb16 = 0x02300033,
  kYuv422_8 = 0x02100032,
  kYuv422_8_UYVY = 0x0210001F,
};

/// The order of colours in a row; of a mosaic, its first two pixels.
enum class PixelColours : std::uint8_t {
  kMono,
  kBayerRG,
  kBayerGR,
  kBayerGB,
  kBayerBG,
  kRgb,
  kBgr,
  kYuyv,  ///< Y0 U Y1 V: two pixels share U and V
  kUyvy,  ///< U Y0 V Y1
};

/// Layout of samples in bytes. In all layouts samples are unsigned, their least significant bits come first where they
/// share bytes or fill several, and rows have no padding.
enum class PixelPacking : std::uint8_t {
  kWhole,   ///< each sample in whole bytes of its own, the low one first; unused high bits are 0
  kStream,  ///< PFNC "p": one stream of bits without gaps, each byte filled from its lowest bit
  kTriple,  ///< GigE Vision "Packed": two samples in three bytes, high 8 bits of the first, low bits of both (of the
            ///< first from bit 0, of the second from bit 4), high 8 bits of the second
};

struct PixelFormatTraits {
  PixelFormat format;
  std::string_view name;  ///< of the convention; a zero follows the last letter
  PixelColours colours;
  int bits;          ///< significant, of a sample
  int bitsPerPixel;  ///< in the stream
  PixelPacking packing;

  std::uint32_t code() const { return static_cast<std::uint32_t>(format); }  ///< Returns the code that cameras send.
  /// Returns whether the format is a colour mosaic.
  bool isBayer() const { return colours >= PixelColours::kBayerRG && colours <= PixelColours::kBayerBG; }
  int full() const { return (1 << bits) - 1; }  ///< Returns the brightest level, 255 for 8 bits.

  /// Returns the size of a picture of `width` x `height` pixels without padding [bytes], rounded up. If `width` pixels
  /// do not fill whole bytes, rows begin within a byte.
  std::size_t size(int width, int height) const {
    const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    return (pixels * static_cast<std::size_t>(bitsPerPixel) + 7) / 8;
  }
  /// Returns the bytes from row to row, without padding; 0 if rows begin within a byte, or within a group of pixels
  /// that share bytes, or if that is more than an int holds.
  int stride(int width) const;
};

/// Returns all formats, in the order in which they are listed for the operator. They live as long as the program.
std::span<const PixelFormatTraits> pixelFormats();
inline constexpr std::string_view kPixelFormatsInWords =
    "Mono, BayerRG, BayerGR, BayerGB, BayerBG with 8, 10, 10p, 10Packed, 12, 12p, 12Packed, 16; Mono14, Mono14p; "
    "RGB, BGR with 8, 10, 10p, 12, 12p, 16; YUV422_8, YUV422_8_UYVY";

/// Returns the traits of a format, which must be one of pixelFormats() (asserted). They live as long as the program.
const PixelFormatTraits& traitsOf(PixelFormat format);

// Return the traits of a format, which live as long as the program; nullptr if it cannot be read. A name must be
// spelled as in PixelFormatTraits::name: "RGB8" is found, "RGB8Packed" and "rgb8" are not.
const PixelFormatTraits* pixelFormatByCode(std::uint32_t code);
const PixelFormatTraits* pixelFormatByName(std::string_view name);

}  // namespace tractiond
