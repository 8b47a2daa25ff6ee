// Reads what packets of a GigE Vision stream say of it, to name why no frame of them becomes whole. Aravis shows
// neither packets nor leaders of frames that it cannot assemble.
#pragma once

#include "daemon/capture/sent_picture.h"

#include <cstddef>
#include <cstdint>
#include <span>

namespace tractiond::capture {

/// Reads the first frame whose leader comes, to its end. Thread-bound.
class PacketSurvey {
 public:
  /// Reads a packet.
  /// \param packet with the GVSP header; any bytes
  /// \param fromPort of the sender
  void see(std::span<const std::uint8_t> packet, std::uint16_t fromPort);

  /// Returns whether a leader came and was long enough for its payload type; the rest is valid only then.
  bool hasLeader() const { return hasLeader_; }
  /// Returns whether the frame of the leader has ended: see() has no effect any more.
  bool isOver() const { return isOver_; }
  /// Returns what the leader says; `size` is 0.
  const SentPicture& picture() const { return picture_; }
  std::uint16_t port() const { return port_; }       ///< Returns the port that the leader came from.
  bool extendedIds() const { return extendedIds_; }  ///< Returns whether the ids are of 64 and 32 bits.
  /// Returns the bytes of the largest data packet, without headers; 0: fewer than two came.
  std::size_t block_bytes() const { return packets_ < 2 ? 0 : largest_; }

 private:
  SentPicture picture_;
  std::uint16_t port_ = 0;
  bool hasLeader_ = false, isOver_ = false, extendedIds_ = false;
  std::uint64_t frame_ = 0;
  int packets_ = 0;
  std::uint64_t lastId_ = 0;  ///< of a packet
  std::size_t largest_ = 0;   ///< data of a packet
};

}  // namespace tractiond::capture
