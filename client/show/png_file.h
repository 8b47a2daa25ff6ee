// Writes pictures as PNG files. The only part of the client that knows libpng.
#pragma once

#include <cstdint>
#include <string>

namespace traction::client {

/// Writes a PNG file, which is replaced if it exists.
/// \param channels 1: grey, 3: red, green, blue
/// \param levels height x width x channels, row by row
/// \param measuredWith Snapshot::measuredWith, which traction-lens reads from the file's text of that name; empty: none
/// \throws OutputError if it cannot be written
void writePng(const std::string& path, std::uint32_t width, std::uint32_t height, std::uint32_t channels,
              const std::uint8_t* levels, const std::string& measuredWith);

}  // namespace traction::client
