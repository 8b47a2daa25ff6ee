// Identifies and checks a rest pose. Reentrant.
#pragma once

#include "daemon/records/marker_field.h"

namespace tractiond::track {

/// Returns the hash of everything in the pose except `id` and `requestedBy`. An empty `oddity` does not enter the
/// hash, as poses of earlier versions have none. Allocates nothing.
Id idOf(const RestPose& pose);

/// Returns whether the numbers can be those of a rest pose: finite, the noise above 0, `shotNoise` not below 0, each
/// `oddity` 0 to 1000, presence 0 or 1. Does not check the cross-talk, the id, nor any size but that of `oddity`
/// (empty, or that of `amplitude`). Allocates nothing.
bool isSane(const RestPose& pose);

}  // namespace tractiond::track
