// Filters the datagrams of the camera's control channel (GVCP): only answers of that camera pass.
//
// Aravis 0.8.26 accepts an answer from any sender if it has the number of the request, which has 16 bits and counts up.
// A forged answer that no client controls the camera makes the camera count as lost.
#pragma once

#include <linux/filter.h>

#include <cstdint>
#include <vector>

namespace tractiond::capture {

/// Returns the program for SO_ATTACH_FILTER on a UDP socket. It passes acknowledgements, pending acknowledgements and
/// refusals (GigE Vision 2.2, part GVCP) of reads and writes of registers and memory, from this address and port.
/// \param address IPv4: 127.0.0.1 is 0x7f000001 \param port in the byte order of the machine
std::vector<sock_filter> controlFilter(std::uint32_t address, std::uint16_t port);

}  // namespace tractiond::capture
