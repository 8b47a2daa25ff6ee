// Compares what a frame says of its picture with what was agreed upon with the camera. Pure functions; the callers are
// the driver, for each frame, and PacketSurvey.
#pragma once

#include "daemon/capture/camera_info.h"
#include "base/pixel_format.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

namespace tractiond::capture {

/// What the leader of a frame says, and how much came with it. A frame of chunk data (payload type 4) says nothing of
/// its picture but the size.
struct SentPicture {
  static constexpr int kPicture = 1, kChunks = 4, kPictureAndChunks = 5;
  int payloadType = kPicture;      ///< of GVSP or USB3 Vision, without the bit that announces chunk data (0x4000)
  int width = 0, height = 0;       ///< px
  std::uint32_t format = 0;        ///< PFNC
  int x = 0, y = 0;                ///< px, on the sensor
  int paddingX = 0, paddingY = 0;  ///< bytes behind each row, and behind the last
  std::size_t size = 0;            ///< bytes that came; of chunk data, those of the first chunk, 0 if it cannot be read
};

/// Where the picture lies in a buffer, from its first byte on.
struct PictureLayout {
  int stride = 0;         ///< bytes from row to row; 0: rows begin within bytes, with no gaps
  std::size_t bytes = 0;  ///< with the padding
};

/// Returns where the picture lies; nothing if deviation() names something. Allocates nothing.
std::optional<PictureLayout> layoutOf(const SentPicture& sent, const PictureShape& agreed);

/// Names the first thing in which a frame differs from what was agreed upon, as the end of a sentence about the camera:
/// "sends pictures of 636 x 480 pixels, its Width and Height say 640 x 480". Empty: nothing. The offset is not
/// compared.
std::string deviation(const SentPicture& sent, const PictureShape& agreed);

/// Returns what to do about a deviation() of a frame of this payload type: the feature to set so that the camera sends
/// pictures, or, of a picture, the keys of the configuration.
std::string remedyOf(int payloadType);

}  // namespace tractiond::capture
