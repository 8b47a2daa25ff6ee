// What a process that ends by a signal still says to its camera: it is free. Else it would keep to a client that is
// dead until its heartbeat has run out, three seconds for most.
#pragma once

#include <cstdint>

namespace tractiond::capture {

/// From here on SIGABRT (a watchdog's, a failed assertion's), SIGBUS, SIGFPE, SIGILL and SIGSEGV send it, by this
/// socket, before they do what they did; of several cameras the last. \param address IPv4, 127.0.0.1 as 0x7f000001. Any
/// thread.
void armLastWill(int socket, std::uint32_t address, std::uint16_t port);
/// Before the socket is closed.
void disarmLastWill(int socket);

}  // namespace tractiond::capture
