// Is a camera's description one that can be evaluated at all? Internal to this folder.
#pragma once

#include "daemon/capture/aravis.h"

#include <functional>
#include <string>

namespace tractiond::capture {

/// Every node of a description, those in groups too.
void forEachNode(ArvGc* description, const std::function<void(ArvGcNode*)>& visit);

/// The texts of a node's elements whose names are in the list.
std::vector<std::string> elementTexts(ArvGcNode* node, std::initializer_list<const char*> names);

/// Empty, or a sentence: a value that depends on itself would be followed without end, and takes the process with it.
std::string faultOf(ArvGc* description);

}  // namespace tractiond::capture
