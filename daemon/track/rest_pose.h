// Identifies and checks a rest pose. Reentrant.
#pragma once

#include "daemon/records/marker_field.h"

namespace tractiond::track {

/// Returns the hash of everything in the pose except `id` and `requestedBy`. An empty `oddity` does not enter the
/// hash, as poses of earlier versions have none. Allocates nothing.
Id idOf(const RestPose& pose);

/// Returns whether the numbers can be those of a rest pose. Does not check sizes and id.
bool isSane(const RestPose& pose);

}  // namespace tractiond::track
