// Bytes that are published, proto/traction/v1 -> messages.
#pragma once

#include "traction/subscriber.h"

#include <string_view>

namespace traction {

// All throw Error kMalformed.
Field decodeField(std::string_view bytes);
Markers decodeMarkers(std::string_view bytes);
Description decodeDescription(std::string_view bytes);
Status decodeStatus(std::string_view bytes);
Preview decodePreview(std::string_view bytes);

}  // namespace traction
