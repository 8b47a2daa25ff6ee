// Decompresses the chunks of recordings that other programs compressed: MCAP's own tools do by default.
#pragma once

#include <tl/expected.hpp>

#include <cstdint>
#include <string>
#include <string_view>

namespace recording {

/// Replaces `to` by the `size` bytes that a chunk was compressed from. Error: why not, as text; `to` then has no
/// meaning. Reentrant.
/// \param compression name in the chunk: "zstd" or "lz4" (its frame format); others are an error
/// \param packed untrusted
/// \param size number of bytes that the chunk states; another number is an error. The caller bounds it: this many are
/// allocated at once
tl::expected<void, std::string> decompress(std::string_view compression, std::string_view packed, std::uint64_t size,
                                           std::string& to);

}  // namespace recording
