// Gives the camera free when the process ends by a signal. Else the camera would keep to a dead client until its
// heartbeat has run out, three seconds for most (docs/decisions/0018-hangs.md).
#pragma once

#include <cstdint>
#include <string>

namespace tractiond::capture {

/// Starts a process that gives the camera free when this one has ended in a way that it cannot see coming, such as
/// SIGKILL. To be called once, while there is no other thread. \return 0, or the reason (errno) why there is none
int startExecutor();

/// Returns why nothing would give the camera free at once if this process were killed now, as the beginning of a
/// sentence: the process that startExecutor() was to start could not be started, or has ended. Empty: it runs, or was
/// not asked for. Waits for nothing, and may be called from any thread.
std::string whyCameraWouldStayLocked();

/// From here on SIGABRT (a watchdog's, a failed assertion's), SIGBUS, SIGFPE, SIGILL and SIGSEGV send it, by this
/// socket, before they do what they did; of several cameras the last. \param address IPv4, 127.0.0.1 as 0x7f000001. Any
/// thread.
void armLastWill(int socket, std::uint32_t address, std::uint16_t port);
/// Before the socket is closed.
void disarmLastWill(int socket);

}  // namespace tractiond::capture
