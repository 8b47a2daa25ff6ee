// The status as lines of text, for tractionctl status.
#pragma once

#include "traction/status.h"

#include <string>

namespace traction::client {

/// Returns lines that end with a newline, with '?' for what is not printable: one about sensor, camera and uptime, then
/// what the options in proto/traction/v1/status.proto say.
/// \param status its message must not be null
std::string statusText(const Status& status);

/// Returns what the kernel has granted for real time: "priority 19 to 20 on 2-3, memory locked"; "off" if nothing.
std::string grantedOf(const v1::Status& status);

}  // namespace traction::client
