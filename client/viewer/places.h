// Where the force nodes are in the camera's picture.
#pragma once

#include "traction/description.h"

#include <vector>

namespace traction::view {

/// u, v [px] of node after node, through gel, window and lens as the description has them. Empty: there are none.
std::vector<float> nodePlaces_px(const Description& description);

}  // namespace traction::view
