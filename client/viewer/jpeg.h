// Compresses previews for browsers. The only part that knows libturbojpeg.
#pragma once

#include "traction/messages.h"

#include <memory>
#include <string_view>

namespace traction::view {

/// Owns a compressor and the memory of its result. Thread-bound.
class JpegEncoder {
 public:
  JpegEncoder();  ///< Has no errors: if libturbojpeg cannot start, encode() returns nothing.
  ~JpegEncoder();
  JpegEncoder(const JpegEncoder&) = delete;
  JpegEncoder& operator=(const JpegEncoder&) = delete;

  /// Returns the picture as a JPEG file of quality 85, which stays valid until the next call. Returns an empty view if
  /// the picture has no pixels, or cannot be compressed: it is too large, or memory is short. Colours are not
  /// subsampled: markers are small and coloured. \param preview must have
  /// height x width x channels pixels, with 1 or 3 channels: this is not checked
  std::string_view encode(const Preview& preview);

 private:
  struct Compressor;
  std::unique_ptr<Compressor> compressor_;
};

}  // namespace traction::view
