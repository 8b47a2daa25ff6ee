// The end of a connection on this side, by which it is known to which endpoint it belongs.
#pragma once

#include <string>

namespace tractiond::publish {

/// Returns "ipc://PATH" or ":PORT" of a connection; empty: it is none, or of another kind.
std::string localEnd(int fd);

/// Returns the same of an endpoint's connections.
std::string localEndOf(const std::string& endpoint);

}  // namespace tractiond::publish
