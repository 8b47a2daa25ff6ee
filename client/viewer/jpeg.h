// Compresses previews for browsers. The only part that knows libturbojpeg.
#pragma once

#include "traction/messages.h"

#include <string>

namespace traction::view {

/// Returns the picture as a JPEG file of quality 85. Returns an empty text if the picture has no pixels, or cannot be
/// compressed: it is too large, or memory is short. Colours are not subsampled: markers are small and coloured.
/// Reentrant. \param preview must have height x width x channels pixels, with 1 or 3 channels: this is not checked
std::string jpegOf(const Preview& preview);

}  // namespace traction::view
