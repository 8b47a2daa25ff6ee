// Checks whether a camera's description can be evaluated safely. Internal to this folder.
#pragma once

#include "daemon/capture/aravis.h"

#include <functional>
#include <string>
#include <string_view>

namespace tractiond::capture {

/// Calls visit for every node of a description that can have a value, those in groups and in other nodes too.
void forEachNode(ArvGc* description, const std::function<void(ArvGcNode*)>& visit);

/// Returns the texts of a node's elements whose names are in the list.
std::vector<std::string> elementTexts(ArvGcNode* node, std::initializer_list<const char*> names);

/// Returns why the text of a description is not whole, as a sentence; empty: it is.
std::string faultOfText(std::string_view xml);

/// Returns why a description must not be evaluated, as a sentence; empty: it may be. A value depends on itself, which
/// Aravis would follow without end; a register takes more memory than any camera has. Reads the lengths that the camera
/// itself tells.
std::string faultOf(ArvGc* description);

}  // namespace tractiond::capture
