// Reads the chunk data that a camera sends behind the picture (GenICam GenTL / GigE Vision 2.0, "chunk data payload").
#pragma once

#include "daemon/capture/camera_info.h"
#include "daemon/records/frame.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace tractiond::capture {

/// Where one number lies in its chunk, by the camera's description.
struct ChunkField {
  enum class Meaning : std::uint8_t { kExposure_us, kGain, kTimestamp_ns, kFrameId, kLines };
  Meaning meaning = Meaning::kExposure_us;
  std::uint64_t chunk = 0;  ///< the chunk's id
  std::size_t offset = 0;   ///< of the number in its chunk [bytes]
  std::size_t length = 0;   ///< 1 to 8 bytes
  bool isFloat = false;     ///< of 4 or 8 bytes
  bool isSigned = false;    ///< of an integer
  bool bigEndian = true;    ///< of the number
  double perUnit = 1.0;     ///< what one count is worth in the meaning's unit
};

/// Values found in the chunks.
struct Chunks {
  FrameExtras extras;
  std::optional<std::int64_t> timestamp_ns;
  std::optional<std::uint64_t> frameId;
};

/// Reads a buffer's chunks from its end: each is data, id and length. Ignores chunks without a field. Allocates
/// nothing. Reentrant.
/// \param picture least size of the picture [bytes]
/// \param bigEndian byte order of ids and lengths: true for GigE Vision, false for USB3 Vision
/// \param chunks receives the values that were found; the others stay as they are
/// \return size of the picture at the buffer's start [bytes], at least `picture`, and `picture` itself if nothing lies
/// behind it; nothing if the buffer is shorter than that or what lies behind it is not chunk data: `chunks` may then
/// have received values all the same
std::optional<std::size_t> readChunks(std::span<const std::uint8_t> buffer, std::size_t picture, bool bigEndian,
                                      std::span<const ChunkField> fields, Chunks& chunks);

}  // namespace tractiond::capture
