// Finds in a camera's description (its GenICam XML) where the numbers lie in its chunks. Internal to this folder.
#pragma once

#include "daemon/capture/aravis.h"
#include "daemon/capture/chunk_reader.h"

#include <string>
#include <vector>

namespace tractiond::capture {

struct ChunkDescription {
  std::vector<ChunkField> fields;   ///< numbers that readChunks() can read
  std::vector<std::string> names;   ///< features of `fields`, in the same order
  std::vector<std::string> unread;  ///< features it may send that are computed or lack a place, so cannot be read
};

/// Reads where the numbers lie from the camera's description, and what scales them: of an open camera it may read
/// features. Knows exposure, gain, time stamp, frame id and line levels. Without chunks all three lists are empty.
ChunkDescription describeChunks(ArvDevice* device);

}  // namespace tractiond::capture
