// The status as lines of text, for tractionctl status.
#pragma once

#include "traction/status.h"

#include <string>

namespace traction::cli {

/// Returns lines that end with a newline. What they say is in the options of proto/traction/v1/status.proto.
std::string statusText(const Status& status);

/// Returns what the kernel grants: "priority 19 to 20 on 2-3, memory locked"; "off" if nothing.
std::string grantedOf(const v1::Status& status);

}  // namespace traction::cli
