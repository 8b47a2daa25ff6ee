// Makes a device without a camera: its registers remember what was written to them. Internal to this folder.
#pragma once

#include "daemon/capture/aravis.h"

#include <string>
#include <vector>

namespace tractiond::capture {

/// Returns every feature node of a description (features, registers, entries, categories; not groups), those in groups
/// and in other nodes too, in the order of the text.
std::vector<ArvGcNode*> nodesOf(ArvGc* description);

/// Makes a device with this description. Its registers are 0 at first; but read-only ones that report abilities of a
/// camera (pIsImplemented, pIsAvailable) have all bits set, and those that give the largest value of a feature (pMax)
/// hold 4096. It cannot stream. Returns nullptr and sets `failure` if the description is not whole, or has no features.
/// What it says may end the process, or keep it busy: this is for a child.
/// \param xml text of the description; is copied
Ref<ArvDevice> makePaperDevice(const std::string& xml, Failure& failure);

}  // namespace tractiond::capture
