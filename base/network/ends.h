// What the kernel knows of a connection, by its file descriptor. Its local end identifies the endpoint, the other end
// the peer. All calls of the kernel about peers' connections are here, so that tests/simulation can define these
// functions instead (docs/decisions/0034-simulation.md); accept() alone is in connection_limit.cpp.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

namespace tractiond::network {

/// Returns the local end of a connection or listening socket, "ipc://PATH", "ipc://@NAME" or ":PORT" ("ipc://" or ":0"
/// if it has no name); empty if `fd` is not a socket of these kinds. Reentrant.
std::string localEnd(int fd);

/// Returns the localEnd() of the connections to an endpoint, "tcp://ADDRESS:PORT" or "ipc://PATH": of a text that does
/// not begin with "ipc://", the part from the last colon on. A text without a colon is returned unchanged. Reentrant.
inline std::string localEndOf(const std::string& endpoint) {
  const std::size_t colon = endpoint.rfind(':');
  return endpoint.starts_with("ipc://") || colon == std::string::npos ? endpoint : endpoint.substr(colon);
}

/// Returns the peer of a connection as text for the log: "uid 1000, pid 4711" for ipc, else its numeric IP address
/// without the port, or "a peer" if it has none. Empty if `fd` is not a connection, or it has ended. Reentrant.
std::string peerOf(int fd);

/// Returns a number that no other connection has had since the kernel's start; 0 if `fd` is not a socket. Reentrant.
std::uint64_t cookieOf(int fd);

struct Unread {
  std::uint64_t socket = 0;  ///< inode: the descriptor's number may become another socket's
  /// Over TCP, bytes that the peer's kernel has not acknowledged: it may hold more that its program has not read. Over
  /// ipc, memory of what the peer has not read, with the kernel's overhead. 0: nothing.
  int bytes = 0;
};
/// Returns what the kernel still holds for the peer of a connection; nothing if `fd` is not a socket, or listens on
/// TCP. Reentrant.
std::optional<Unread> unreadOf(int fd);

/// Returns a number that no open descriptor of this process reaches; 0 if /proc cannot be read. Allocates.
int endOfDescriptorTable();

/// Reads from a connection as recv() of the C library does. Reentrant.
ssize_t receive(int fd, void* buffer, std::size_t size, int flags);

/// Ends a connection for both directions; its descriptor stays open. Returns whether it could. Reentrant.
bool shutDown(int fd);

}  // namespace tractiond::network
