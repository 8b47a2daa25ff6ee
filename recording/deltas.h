// Pictures, smaller: noise is in the differences of neighbours what it is in them, and the rest is nearly nothing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace recording {

/// A zlib stream of the differences, modulo 256, of each byte from that `delta` before it. \param scratch keeps its
/// memory
void packDeltas(std::string_view bytes, std::size_t delta, std::string& scratch, std::string& to);

/// False: damaged, or not of as many bytes as `to` has.
bool unpackDeltas(std::string_view packed, std::size_t delta, std::span<std::uint8_t> to);

}  // namespace recording
