// Pixel formats of the twin's camera.
#pragma once

#include "base/pixel_format.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace twin {

/// One of formats().
using Format = tractiond::PixelFormat;

/// Colour channels. A grey picture has only the second.
enum Channel : std::size_t { kRed, kGreen, kBlue };

/// Returns the formats that the twin draws, in the order in which they are listed for its user.
std::span<const Format> formats();

/// Returns all names as one text: "RGB8, BGR8, ..."
std::string formatNames();

/// Returns the format with this name (exact case); nothing if there is none.
std::optional<Format> formatByName(const std::string& name);

/// Returns the channels of a mosaic's 2 x 2 pixels, row by row; kGreen of other formats.
std::array<Channel, 4> cellOf(Format format);

/// Returns the samples per pixel: 3 for RGB and BGR, else 1.
std::size_t samplesPerPixel(Format format);

/// Packs samples of more than 8 bits, right-aligned, into the format's bytes. The format must have more than 8 bits
/// (asserted); `bytes` must hold them all.
void pack(Format format, std::span<const std::uint16_t> samples, std::span<std::uint8_t> bytes);

}  // namespace twin
