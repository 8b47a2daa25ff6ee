// The ends of a connection: by the one on this side it is known to which endpoint it belongs, by the other whose it is.
#pragma once

#include <string>

namespace tractiond::network {

/// Returns "ipc://PATH" or ":PORT" of a connection; empty: it is none, or of another kind.
std::string localEnd(int fd);

/// Returns the same of an endpoint's connections.
std::string localEndOf(const std::string& endpoint);

/// Returns whose a connection is, for people: "uid 1000, pid 4711", or an address. Empty: it is none, or has ended.
std::string peerOf(int fd);

}  // namespace tractiond::network
