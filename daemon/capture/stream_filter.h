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
  std::uint32_t cameraAddress = 0;  ///< IPv4, 127.0.0.1 as 0x7f000001
  std::uint16_t cameraPort = 0;     ///< source port of the stream; 0: not known
  int packetSize_bytes = 1500;      ///< the largest packet, with the headers of IP, UDP and GVSP
  std::size_t payload_bytes = 0;    ///< of the largest frame: picture and chunk data
  bool extendedIds = false;         ///< 64-bit block ids and 32-bit packet ids

  // Return the bytes of a packet's GVSP header, and of the picture in each data packet but the last.
  int headerBytes() const { return extendedIds ? 20 : 8; }
  int blockBytes() const { return packetSize_bytes - 28 - headerBytes(); }
  /// Returns the number of data packets in the largest frame, without leader and trailer.
  std::uint32_t blocks() const {
    const auto block = static_cast<std::size_t>(blockBytes());
    return static_cast<std::uint32_t>((payload_bytes + block - 1) / block);
  }
};

/// Returns the program for SO_ATTACH_FILTER on a UDP socket. It passes leaders of pictures (with or without chunk data)
/// and of chunk data alone with packet id 0, data with ids from 1 to blocks() that are no longer than a block, trailers
/// with ids from 2 to blocks() + 1, and reports that a packet cannot be resent: all from the camera's address and port
/// (any port if cameraPort is 0), with ids of StreamShape's width. \param shape packetSize_bytes of at least 100,
/// payload_bytes of at least 1
std::vector<sock_filter> streamFilter(const StreamShape& shape);

}  // namespace tractiond::capture
