// Reads how large a picture file says it is, before anything is decoded: a file of some bytes may say anything.
#pragma once

#include <tl/expected.hpp>

#include <cstdint>
#include <string>
#include <string_view>

namespace lens {

struct PictureHeader {
  std::uint32_t width = 0, height = 0;  ///< px
  std::uint64_t decoded_bytes = 0;      ///< of all its samples; of a TIFF's tile if that is larger
};

/// Returns the header of a PNG, JPEG or TIFF file. On failure returns what is wrong, as the end of a sentence about the
/// file: another type, or a header that is damaged or cut off. Checks nothing beyond the header. Reentrant.
tl::expected<PictureHeader, std::string> headerOf(std::string_view file);

}  // namespace lens
