// Compresses pictures by the differences of neighbouring pixels, which have little beyond the noise.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace recording {

/// Replaces `to` by a zlib stream of the differences, modulo 256, of each byte from the byte `delta` before it (the
/// first `delta` bytes from 0). Returns false if zlib has no memory; `to` then has no meaning. Reentrant.
/// \param bytes less than 4 GiB, not part of the two strings
/// \param delta for pictures the bytes per pixel; 0 counts as 1
/// \param scratch working memory that is kept between calls
bool packDeltas(std::string_view bytes, std::size_t delta, std::string& scratch, std::string& to);

/// Decompresses what packDeltas() made with the same `delta` into `to`, of less than 4 GiB. Returns false if the stream
/// is damaged, holds another number of bytes than `to`, `delta` is 0 or to.data() is null; `to` is then filled with 0.
/// Another `delta` is not noticed. Reentrant.
bool unpackDeltas(std::string_view packed, std::size_t delta, std::span<std::uint8_t> to);

}  // namespace recording
