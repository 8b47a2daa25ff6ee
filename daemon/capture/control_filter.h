// Lets only the camera's answers reach the camera's control channel (GVCP).
//
// Aravis 0.8.26 accepts any datagram at its port as the camera's answer if it has the number of the request, which has
// 16 bits and is one more than the last. A forged answer that no client controls the camera makes Aravis give it up.
#pragma once

#include <linux/filter.h>

#include <cstdint>
#include <vector>

namespace tractiond::capture {

/// Returns the program for SO_ATTACH_FILTER on a UDP socket. It accepts acknowledgements, pending acknowledgements and
/// refusals (GigE Vision 2.2, part GVCP) of reads and writes of registers and memory, from that address and port.
/// \param address IPv4, 127.0.0.1 as 0x7f000001
std::vector<sock_filter> controlFilter(std::uint32_t address, std::uint16_t port);

}  // namespace tractiond::capture
