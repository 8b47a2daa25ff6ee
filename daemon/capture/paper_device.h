// Simulates a device by its description: registers keep what is written. Internal to this folder.
#pragma once

#include "daemon/capture/aravis.h"

#include <string>

namespace tractiond::capture {

/// Creates the device. Registers are 0, except for those that state abilities, whose bits are all 1. Keeps `xml`.
Ref<ArvDevice> makePaperDevice(const std::string& xml, Failure& failure);

}  // namespace tractiond::capture
