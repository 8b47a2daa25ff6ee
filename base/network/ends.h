// Names the two ends of a connection: the local end identifies its endpoint, the other end its peer.
#pragma once

#include <string>

namespace tractiond::network {

/// Returns the local end of a connection, "ipc://PATH" or ":PORT"; empty if `fd` is not a connection of these kinds.
std::string localEnd(int fd);

/// Returns the localEnd() of the connections to an endpoint.
std::string localEndOf(const std::string& endpoint);

/// Returns the peer of a connection as text for the log: "uid 1000, pid 4711", or an address. Empty if `fd` is not a
/// connection, or it has ended.
std::string peerOf(int fd);

}  // namespace tractiond::network
