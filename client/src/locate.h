// Finds the endpoints of an instance.
#pragma once

#include "proto/traction/v1/endpoints.h"
#include "traction/error.h"

namespace traction {

/// Returns the endpoints at which an instance may be reached; never empty. Looks at files only: whether a daemon
/// answers is not known. If its sockets exist in a runtime directory and may be opened, these are the only ones.
/// Otherwise, for the default instance: TCP for publishing, and the last runtime directory's socket for control; for
/// others: the sockets of all directories in which it may start, of which /tmp/tractiond-UID is made so that it is no
/// other user's.
/// \throws Error kBadEndpoint if `instance` is not a valid name, or if another user may control the directory of the
/// sockets
/// \param program kDaemon, or kTouch, which has a stream only
std::vector<Endpoints> locate(const std::string& instance, std::string_view program = kDaemon);

/// Returns a kBadEndpoint error for an endpoint that ZeroMQ refuses for the reason `why`. The message shows how
/// endpoints are written.
Error badEndpoint(const std::string& endpoint, const std::string& why);

}  // namespace traction
