// Socket files of ipc endpoints, which ZeroMQ replaces without looking. The functions are reentrant.
#pragma once

#include "base/error.h"

#include <optional>
#include <string>

namespace tractiond::network {

/// Returns the path of an endpoint's socket file; empty if it has none: ipc://@NAME, or no ipc endpoint.
std::string socketFileOf(const std::string& endpoint);

/// Returns why the socket file of an endpoint cannot be bound; nothing if it can, or if the endpoint has none. ZeroMQ
/// would remove whatever has its path, also a socket in use. Errors: EX_CONFIG if the path is too long, EX_CANTCREAT if
/// its directory does not exist or something has its path that is not a socket, EX_UNAVAILABLE if a process listens at
/// it.
std::optional<Error> checkSocketFile(const std::string& endpoint);

}  // namespace tractiond::network
