// Checks whether a camera's description (its GenICam XML, of features and registers) can be evaluated safely. Internal
// to this folder.
#pragma once

#include "daemon/capture/aravis.h"

#include <string>
#include <string_view>
#include <vector>

namespace tractiond::capture {

/// Returns every feature node of a description (features, registers, entries, categories; not groups), those in groups
/// and in other nodes too, in the order of the text.
std::vector<ArvGcNode*> nodesOf(ArvGc* description);

/// Returns the texts of the elements directly in a node whose names are in the list, in the order of the description,
/// without empty ones.
std::vector<std::string> elementTexts(ArvGcNode* node, std::initializer_list<const char*> names);

/// Returns why the text of a description is not well-formed XML, as a sentence; empty: it is. Ignores white space and
/// zero bytes at its end. Does not check what it describes: see faultOf().
std::string faultOfText(std::string_view xml);

/// Returns why a description must not be evaluated, as a sentence; empty: it may be. The reasons: it has no nodes; a
/// value depends on itself, which Aravis would follow without end, or on more than 200 others in a chain, or takes more
/// than 100,000 evaluations; a register has more than 16 MiB. Asks the camera for lengths that it tells itself.
std::string faultOf(ArvGc* description);

}  // namespace tractiond::capture
