// Releases the camera when the process ends by a signal. Otherwise the camera stays locked by the dead client until its
// heartbeat timeout, three seconds for most cameras (docs/decisions/0018-hangs.md).
#pragma once

#include <cstdint>
#include <string>

namespace tractiond::capture {

/// Starts a process that releases the camera after this one was ended without notice, as by SIGKILL. Must be called
/// once, while there is no other thread. Returns 0, or errno if the process cannot be started.
int startExecutor();

/// Returns why the camera would stay locked if this process were killed now, as the beginning of a sentence: the
/// process of startExecutor() could not be started, or has ended. Empty: it runs, or was not requested. Does not wait.
/// Any thread.
std::string whyCameraWouldStayLocked();

/// Installs handlers of SIGABRT (from a watchdog or a failed assertion), SIGBUS, SIGFPE, SIGILL and SIGSEGV that
/// release the camera through this socket before the signal takes effect. Replaces an earlier camera. Any thread.
/// \param address IPv4, 127.0.0.1 as 0x7f000001
void armLastWill(int socket, std::uint32_t address, std::uint16_t port);
/// Must be called before the socket is closed.
void disarmLastWill(int socket);

}  // namespace tractiond::capture
