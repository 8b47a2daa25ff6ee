// The samples of one colour of a picture, read in place without demosaicing.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace tractiond::track {

/// Sample (x, y) is the (x * step)-th of row y, which begins at first + y * stride, and is centred on pixel
/// (u0 + scale x, v0 + scale y). Levels are those of the picture's format: 0 to 4095 in 12 bits.
struct Plane {
  const std::uint8_t* first = nullptr;  ///< null: there is no such plane
  std::ptrdiff_t stride = 0;            ///< bytes from row to row of samples
  int step = 3;                         ///< from sample to sample of this colour: 1, 2 or 3
  bool wide = false;                    ///< samples have 16 bits, in the machine's byte order; else 8
  int width = 0, height = 0;            ///< samples of this colour
  float scale = 1.0F;                   ///< px from sample to sample: 2 on a Bayer mosaic
  float u0 = 0.0F, v0 = 0.0F;           ///< px
  /// Offsets [samples] to the samples of the other colour whose mean stands for that colour at this place. (On a Bayer
  /// mosaic red and blue are diagonal neighbours.)
  std::array<std::ptrdiff_t, 4> other{};
  float otherNoise = 1.0F;  ///< variance of that mean, relative to a sample's
  float sign = 1.0F;        ///< -1: the markers are darker than their surroundings
  float gain = 1.0F;        ///< levels per unit of a sample; 1 where that has 8 bits
  float noise = 1.0F;  ///< variance of a sample, relative to one of the camera's: below 1 where several were averaged
  float unit = 1.0F;   ///< levels in 1/255 of the format's range

  /// Returns the brightness of sample (x, y) [levels], which must lie within width and height; with an offset [samples]
  /// that of another colour's beside it.
  float at(std::ptrdiff_t x, std::ptrdiff_t y, std::ptrdiff_t offset = 0) const {
    const std::uint8_t* row = first + y * stride;
    const std::ptrdiff_t index = x * step + offset;
    return wide ? gain * static_cast<float>(reinterpret_cast<const std::uint16_t*>(row)[index])
                : static_cast<float>(row[index]);
  }
};

}  // namespace tractiond::track
