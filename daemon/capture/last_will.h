// Gives the camera free if the process ends without closing it. Otherwise the camera stays locked by the dead client
// until its heartbeat times out, after 3 s for most (docs/decisions/0018-hangs.md).
#pragma once

#include <cstdint>

namespace tractiond::capture {

/// Starts a process that gives the camera of armLastWill() free when this one ends without notice, as by SIGKILL. Must
/// be called once, before this program starts its first thread. The process ends with this one. \return 0, or an errno
/// if it cannot be started; the camera then stays locked after such an end
int startExecutor();

/// Gives the process of startExecutor() a copy of the socket by which a camera is controlled. Only the camera armed
/// last is given free. Any thread. \param socket UDP, by which the camera is controlled; must stay open until
/// disarmLastWill() \param address of the camera, IPv4: 127.0.0.1 is 0x7f000001
void armLastWill(int socket, std::uint32_t address, std::uint16_t port);
/// Ends that for the camera. Must be called before the socket is closed. Has no effect unless the socket was armed
/// last. Any thread.
void disarmLastWill(int socket);

}  // namespace tractiond::capture
