// Decodes published messages of proto/traction/v1.
#pragma once

#include "traction/subscriber.h"

#include <string_view>

namespace traction {

// Decode the Protobuf bytes of one message. They check shapes and that numbers are finite, and throw Error kMalformed.
Field decodeField(std::string_view bytes);
Markers decodeMarkers(std::string_view bytes);
Description decodeDescription(std::string_view bytes);
Status decodeStatus(std::string_view bytes);
Preview decodePreview(std::string_view bytes);

}  // namespace traction
