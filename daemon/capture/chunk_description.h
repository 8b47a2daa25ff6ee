// Where a camera's description says that the numbers lie in its chunks. Internal to this folder.
#pragma once

#include "daemon/capture/aravis.h"
#include "daemon/capture/chunk_reader.h"

#include <string>
#include <vector>

namespace tractiond::capture {

struct ChunkDescription {
  std::vector<ChunkField> fields;
  std::vector<std::string> names;   ///< of these
  std::vector<std::string> unread;  ///< what the camera may send and cannot be read: it is computed, not stored
};

ChunkDescription describeChunks(ArvDevice* device);

}  // namespace tractiond::capture
