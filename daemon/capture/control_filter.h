// Which datagrams may reach the camera's control channel (GVCP): answers of that camera.
//
// Aravis 0.8.26 takes what comes to its port for the camera's answer, whoever sent it: all that it needs is the
// question's number, of 16 bits and one more than the last. An answer that nobody controls the camera is a camera lost.
#pragma once

#include <linux/filter.h>

#include <cstdint>
#include <vector>

namespace tractiond::capture {

/// The program for SO_ATTACH_FILTER on a UDP socket. It takes acknowledgements, pending ones and refusals (GigE Vision
/// 2.2, part GVCP) of reading and writing registers and memory, from that address and port. \param address IPv4,
/// 127.0.0.1 as 0x7f000001
std::vector<sock_filter> controlFilter(std::uint32_t address, std::uint16_t port);

}  // namespace tractiond::capture
