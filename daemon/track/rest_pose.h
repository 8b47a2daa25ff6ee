// What identifies a rest pose.
#pragma once

#include "daemon/records/marker_field.h"

namespace tractiond::track {

/// Hash of everything in the pose but its id. Allocates nothing.
Id idOf(const RestPose& pose);

/// Its numbers can be those of a rest pose; its sizes and its id are not looked at.
bool isSane(const RestPose& pose);

}  // namespace tractiond::track
