// A device of which there is only a description: registers that remember what was written. Internal to this folder.
#pragma once

#include "daemon/capture/aravis.h"

#include <string>

namespace tractiond::capture {

/// Registers begin as 0, but for those that say what a camera can do: all bits are 1. \param xml is kept
Ref<ArvDevice> makePaperDevice(const std::string& xml, Failure& failure);

}  // namespace tractiond::capture
