// Unpacks packed samples.
#pragma once

#include "base/pixel_format.h"

#include <cstddef>
#include <cstdint>

namespace tractiond::track {

/// Unpacks `count` samples of 10, 12 or 14 bits that begin at `from` to 16 bits each. Layouts: GenICam Pixel Format
/// Naming Convention 2.4, "p" (lsb packed), and GigE Vision 2.2 for its older "Packed" (described at PixelPacking).
/// Reads only the bytes that the samples fill. Reentrant; allocates nothing.
/// \param packing not kWhole
/// \param bits of a sample
/// \param to has room for `count` samples and does not overlap `from`
void unpack(PixelPacking packing, int bits, const std::uint8_t* from, std::size_t count, std::uint16_t* to);

}  // namespace tractiond::track
