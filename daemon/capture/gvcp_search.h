// Asks a GigE Vision camera whether it is there. Aravis can do that as well, but takes a second.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace tractiond::capture {

/// Asks the camera at an IPv4 address ("192.168.1.20") by a discovery packet of the control protocol (GVCP), which a
/// camera answers whichever client controls it, and once more at half the time. Returns whether it has answered within
/// `timeout`; false also without a socket. Reentrant.
/// \param port of the camera; another than the protocol's in tests
bool answersSearch(const std::string& address, std::chrono::milliseconds timeout, std::uint16_t port = 3956);

}  // namespace tractiond::capture
