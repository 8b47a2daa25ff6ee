// What identifies a rest pose.
#pragma once

#include "daemon/records/marker_field.h"

namespace tractiond::track {

/// Hash of everything in the pose but its id. Allocates nothing.
Id idOf(const RestPose& pose);

}  // namespace tractiond::track
