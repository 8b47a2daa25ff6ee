// Filters the datagrams of a stream: only those that its camera can have sent pass.
//
// Aravis 0.8.26 accepts every datagram at its port as the camera's and does not check its lengths and numbers: one
// packet can end the process. So the kernel drops impossible ones before Aravis sees them, by a classic BPF program,
// which needs no privilege.
#pragma once

#include <linux/filter.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tractiond::capture {

/// Shape of a stream of pictures on the wire (GigE Vision 2.2, part GVSP).
struct StreamShape {
  static constexpr int kNetworkHeaders_bytes = 28;  ///< of IP and UDP

  std::uint32_t cameraAddress = 0;  ///< IPv4, 127.0.0.1 as 0x7f000001
  std::uint16_t cameraPort = 0;     ///< source port of the stream; 0: not known
  int packetSize_bytes = 1500;      ///< the largest packet, with the headers of IP, UDP and GVSP
  std::size_t payload_bytes = 0;    ///< of the largest frame: picture and chunk data
  std::size_t picture_bytes = 0;    ///< that each frame has at least, at its start; at most payload_bytes
  bool extendedIds = false;         ///< 64-bit block ids and 32-bit packet ids

  // Return the bytes of a packet's GVSP header, and of the picture in each data packet but the last.
  int headerBytes() const { return extendedIds ? 20 : 8; }
  int blockBytes() const { return packetSize_bytes - kNetworkHeaders_bytes - headerBytes(); }
  /// Returns the number of data packets in the largest frame, without leader and trailer.
  std::uint32_t blocks() const {
    const auto block = static_cast<std::size_t>(blockBytes());
    return static_cast<std::uint32_t>((payload_bytes + block - 1) / block);
  }
};

/// Returns the program for SO_ATTACH_FILTER on a UDP socket. It passes leaders of pictures (with or without chunk data)
/// and of chunk data with packet id 0, data with ids from 1 to blocks() that are no longer than a block, trailers with
/// ids from 2 to blocks() + 1, and reports that a packet cannot be resent: all from the camera's address and port (any
/// port if cameraPort is 0), with ids of StreamShape's width.
///
/// Data packets must fill their block as far as the picture reaches: Aravis places block k at (k - 1) * blockBytes(),
/// so that shorter packets leave holes, and reports success all the same. Such a frame now stays incomplete, and
/// PacketSurvey tells why.
/// \param shape packetSize_bytes of at least 100, payload_bytes of at least 1
std::vector<sock_filter> streamFilter(const StreamShape& shape);

/// Returns the program that passes all datagrams from an address and port, for PacketSurvey and the control channel:
/// Aravis 0.8.26 accepts an answer from any sender if it has the number of the request, which has 16 bits and counts
/// up, and a forged one that no client controls the camera makes the camera count as lost.
/// \param port in the byte order of the machine; 0: any
std::vector<sock_filter> senderFilter(std::uint32_t address, std::uint16_t port = 0);

/// Returns the largest size of packets, at most `largest`, whose block is a multiple of 64 bytes: many cameras round
/// their blocks down to one of 8, 16 or 64. The size is `least` plus a multiple of `increment`, as the camera demands
/// of GevSCPSPacketSize; if no such size divides well, the largest that the camera allows.
/// \param headers_bytes of IP, UDP and GVSP
/// \param least at most `largest`
/// \param increment at least 1
int evenPacketSize(int largest, int headers_bytes, int least, int increment);

}  // namespace tractiond::capture
