// Where the force nodes are in the camera's picture.
#pragma once

#include "traction/description.h"

#include <vector>

namespace traction::view {

/// Returns u, v of node after node [px], projected through gel, window and lens of the description. Empty without
/// nodes, and if the description is implausible, for example with a camera inside the gel.
std::vector<float> nodePlaces_px(const Description& description);

}  // namespace traction::view
