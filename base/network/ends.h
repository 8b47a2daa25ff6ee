// Names the two ends of a connection: the local end identifies its endpoint, the other end its peer.
#pragma once

#include <string>

namespace tractiond::network {

/// Returns the local end of a connection or listening socket, "ipc://PATH", "ipc://@NAME" or ":PORT"; empty if `fd` is
/// not a socket of these kinds. Reentrant.
std::string localEnd(int fd);

/// Returns the localEnd() of the connections to an endpoint, "tcp://ADDRESS:PORT" or "ipc://PATH"; any other text
/// without a colon is returned unchanged.
std::string localEndOf(const std::string& endpoint);

/// Returns the peer of a connection as text for the log: "uid 1000, pid 4711" for ipc, else its numeric IP address
/// without the port. Empty if `fd` is not a connection, or it has ended. Reentrant.
std::string peerOf(int fd);

}  // namespace tractiond::network
