// Where the force nodes are in the camera's picture.
#pragma once

#include "traction/description.h"

#include <vector>

namespace traction::view {

/// Returns u, v of node after node, in the order of Field::force_N, in the camera's full picture [px] or beyond its
/// edges: projected through gel, window and lens of the description; in a straight line those that a curved window
/// hides. Empty without nodes, and if the description is implausible: with a camera inside the gel, focal length or
/// aspect not above 0, or more than a million nodes. Reentrant.
std::vector<float> nodePlaces_px(const Description& description);

}  // namespace traction::view
