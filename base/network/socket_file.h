// What ZeroMQ does not check of an endpoint: socket files, which it replaces, and ports, which it takes modulo 65536.
// The functions are reentrant.
#pragma once

#include "base/error.h"

#include <optional>
#include <string>

namespace tractiond::network {

/// Returns the path of an endpoint's socket file; empty if it has none: ipc://@NAME, or no ipc endpoint.
std::string socketFileOf(const std::string& endpoint);

/// Returns why an endpoint must not be bound: the port of tcp://ADDRESS:PORT is not a number from 0 to 65535 or *, or
/// something else has the path of its socket file, which ZeroMQ would remove, also a socket in use. Returns nothing if
/// there is no such reason. Errors: EX_CONFIG if the port is wrong or the path too long, EX_CANTCREAT if its directory
/// does not exist, something has its path that is not a socket, or that socket cannot be connected to, for lack of
/// permission for example; EX_UNAVAILABLE if a process listens at it. To find that out, connects to the socket file,
/// without waiting. What takes the path between this check and the binding is lost, as no one can lock a path: that
/// needs the permission to write into the directory, and a second daemon is kept from its own by OwnDirectory.
std::optional<Error> checkEndpoint(const std::string& endpoint);

/// Returns the error of an endpoint at which another program listens.
Error inUse(const std::string& endpoint);
/// Returns whether an error is that of inUse(), so that a program can say which other one it may be.
bool isInUse(const Error& error);

}  // namespace tractiond::network
