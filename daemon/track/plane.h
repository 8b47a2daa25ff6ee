// The samples of one colour within a picture, read where they are: no demosaic, no copy.
#pragma once

#include "daemon/records/frame.h"
#include "sensor/gel.h"

#include <array>
#include <cstddef>
#include <cstdint>

namespace tractiond::track {

/// Sample (x, y) lies at first[y * stride + x * step] and is centred on pixel (u0 + scale x, v0 + scale y).
struct Plane {
  const std::uint8_t* first = nullptr;
  std::ptrdiff_t stride = 0;   ///< bytes from row to row of samples
  int step = 3;                ///< bytes from sample to sample: 3 or 2
  int width = 0, height = 0;   ///< samples
  float scale = 1.0F;          ///< px from sample to sample: 2 on a Bayer mosaic
  float u0 = 0.0F, v0 = 0.0F;  ///< px
  /// Bytes from a sample to the samples of the other colour whose mean is taken for the other colour at its place.
  /// (On a Bayer mosaic red and blue are each other's diagonal neighbours.)
  std::array<std::ptrdiff_t, 4> other{};
};

inline bool isBayer(PixelFormat format) {
  return traitsOf(format).isBayer();
}

inline Plane planeOf(const Frame& frame, sensor::Colour colour) {
  const bool red = colour == sensor::Colour::kRed;
  if (!isBayer(frame.format)) {
    const bool low = red == (frame.format == PixelFormat::kRgb8);  // byte 0 of the pixel, else byte 2
    const std::ptrdiff_t other = low ? 2 : -2;
    return {frame.data + (low ? 0 : 2),  frame.stride, 3, frame.width, frame.height, 1.0F, 0.0F, 0.0F,
            {other, other, other, other}};
  }
  // Place of red in the two by two cell; blue is diagonally across.
  int u = frame.format == PixelFormat::kBayerGR8 || frame.format == PixelFormat::kBayerBG8 ? 1 : 0;
  int v = frame.format == PixelFormat::kBayerGB8 || frame.format == PixelFormat::kBayerBG8 ? 1 : 0;
  if (!red) {
    u = 1 - u;
    v = 1 - v;
  }
  const std::ptrdiff_t row = frame.stride;
  return {frame.data + v * row + u,
          2 * row,
          2,
          frame.width / 2,
          frame.height / 2,
          2.0F,
          static_cast<float>(u),
          static_cast<float>(v),
          {-row - 1, -row + 1, row - 1, row + 1}};
}

}  // namespace tractiond::track
