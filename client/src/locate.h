// Which endpoints an instance is met at from here.
#pragma once

#include "proto/traction/v1/endpoints.h"

namespace traction {

/// Of the runtime directory in which the instance's sockets are. Where there is none: TCP for the default instance,
/// else the directories in which it may start. Never empty. Throws Error kBadEndpoint for an impossible name.
std::vector<Endpoints> locate(const std::string& instance);

}  // namespace traction
