// The two ends of a connection: the local one shows the endpoint, the remote one the peer.
#pragma once

#include <string>

namespace tractiond::network {

/// Returns "ipc://PATH" or ":PORT" of a connection; empty: not a connection, or one of another kind.
std::string localEnd(int fd);

/// Returns the same of an endpoint's connections.
std::string localEndOf(const std::string& endpoint);

/// Returns the peer of a connection, for the log: "uid 1000, pid 4711", or an address. Empty: not a connection, or
/// ended.
std::string peerOf(int fd);

}  // namespace tractiond::network
