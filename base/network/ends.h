// Names the two ends of a connection: the local end identifies its endpoint, the other end its peer.
#pragma once

#include <string>

namespace tractiond::network {

/// Returns the local end of a connection or listening socket, "ipc://PATH", "ipc://@NAME" or ":PORT" ("ipc://" or ":0"
/// if it has no name); empty if `fd` is not a socket of these kinds. Reentrant.
std::string localEnd(int fd);

/// Returns the localEnd() of the connections to an endpoint, "tcp://ADDRESS:PORT" or "ipc://PATH": of a text that does
/// not begin with "ipc://", the part from the last colon on. A text without a colon is returned unchanged. Reentrant.
std::string localEndOf(const std::string& endpoint);

/// Returns the peer of a connection as text for the log: "uid 1000, pid 4711" for ipc, else its numeric IP address
/// without the port, or "a peer" if it has none. Empty if `fd` is not a connection, or it has ended. Reentrant.
std::string peerOf(int fd);

}  // namespace tractiond::network
