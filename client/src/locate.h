// Which endpoints an instance is met at from here.
#pragma once

#include "proto/traction/v1/endpoints.h"
#include "traction/error.h"

namespace traction {

/// Of the runtime directory in which the instance's sockets are. Where there is none: for the default instance TCP (control: the service's),
/// else the directories in which it may start. Never empty. Throws Error kBadEndpoint for an impossible name.
std::vector<Endpoints> locate(const std::string& instance);

/// For an endpoint that ZeroMQ refuses; how one is written, in case it is that.
Error badEndpoint(const std::string& endpoint, const std::string& why);

}  // namespace traction
