// Checks whether a camera's description can be evaluated safely. Internal to this folder.
#pragma once

#include "daemon/capture/aravis.h"

#include <functional>
#include <string>
#include <string_view>

namespace tractiond::capture {

/// Calls visit for every node of a description that can have a value, those in groups and in other nodes too.
void forEachNode(ArvGc* description, const std::function<void(ArvGcNode*)>& visit);

/// Returns the texts of a node's elements whose names are in the list, in the order of the description; empty: none.
std::vector<std::string> elementTexts(ArvGcNode* node, std::initializer_list<const char*> names);

/// Returns why the text of a description is not well-formed XML, as a sentence; empty: it is. Ignores white space and
/// zero bytes at its end. Does not check what it describes: see faultOf().
std::string faultOfText(std::string_view xml);

/// Returns why a description must not be evaluated, as a sentence; empty: it may be. The reasons: a value depends on
/// itself, which Aravis would follow without end; a register takes more memory than any camera has. Reads lengths that
/// the camera itself tells.
std::string faultOf(ArvGc* description);

}  // namespace tractiond::capture
