// Compresses previews for browsers. The only part that knows libturbojpeg.
#pragma once

#include "traction/messages.h"

#include <memory>
#include <string_view>

namespace traction::view {

/// Thread-bound.
class JpegEncoder {
 public:
  JpegEncoder();
  ~JpegEncoder();
  JpegEncoder(const JpegEncoder&) = delete;
  JpegEncoder& operator=(const JpegEncoder&) = delete;

  /// Returns the picture as a JPEG file, which stays valid until the next call. Returns nothing if the picture has no
  /// pixels, or memory is short. Colours are not subsampled: markers are small and coloured. \param preview must have
  /// height x width x channels pixels, with 1 or 3 channels: this is not checked
  std::string_view encode(const Preview& preview);

 private:
  struct Compressor;
  std::unique_ptr<Compressor> compressor_;
};

}  // namespace traction::view
