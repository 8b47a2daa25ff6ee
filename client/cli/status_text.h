// The status as lines of text, for tractionctl status.
#pragma once

#include "traction/status.h"

#include <string>

namespace traction::cli {

/// Returns lines that end with a newline. What they say is in the options of proto/traction/v1/status.proto.
std::string statusText(const Status& status);

/// Returns the state of the camera, with the reason: "camera lost, being looked for (it does not answer)".
std::string cameraSentence(const v1::Status& status);

/// Returns whether the daemon runs without a gel file, and therefore publishes no field.
bool isWithoutGel(const v1::Status& status);

/// Returns what the kernel grants: "priority 19 to 20 on 2-3, memory locked"; "off" if nothing.
std::string grantedOf(const v1::Status& status);
/// Returns what was configured but not granted: "priority 20, memory"; empty: nothing.
std::string refusedOf(const v1::Status& status);

}  // namespace traction::cli
