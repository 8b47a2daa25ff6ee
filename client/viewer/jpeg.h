// Compresses pictures for browsers. The only part that knows libturbojpeg.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace traction::view {

/// Returns the picture as a JPEG file of quality 85. Returns an empty text if the picture has no pixels, or cannot be
/// compressed: it is too large, or memory is short. Colours are not subsampled: markers are small and coloured.
/// Reentrant.
/// \param pixels height x width x channels, row by row
/// \param channels 1: grey, 3: red, green, blue. Neither is checked
std::string jpegOf(std::span<const std::uint8_t> pixels, std::uint32_t width, std::uint32_t height,
                   std::uint32_t channels);

}  // namespace traction::view
