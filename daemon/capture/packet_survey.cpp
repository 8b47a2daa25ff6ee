#include "daemon/capture/packet_survey.h"

#include <algorithm>

namespace tractiond::capture {
namespace {

using Bytes = std::span<const std::uint8_t>;

/// Big-endian; the bytes must be there.
std::uint64_t number(Bytes bytes, std::size_t at, std::size_t width) {
  std::uint64_t value = 0;
  for (const std::uint8_t byte : bytes.subspan(at, width)) value = value << 8 | byte;
  return value;
}

constexpr std::size_t kShortHeader = 8, kLongHeader = 20;
constexpr int kLeader = 1, kTrailer = 2;
constexpr std::size_t kTypeEnds = 4, kPictureEnds = 36;  // in the leader behind the header

int side(Bytes bytes, std::size_t at) {
  return static_cast<int>(std::min<std::uint64_t>(number(bytes, at, 4), 0x7fffffff));
}

}  // namespace

void PacketSurvey::see(Bytes packet, std::uint16_t fromPort) {
  if (isOver_ || packet.size() < kShortHeader || (packet[0] & 0x80U) != 0) return;
  const bool extended = (packet[4] & 0x80U) != 0;
  const std::size_t header = extended ? kLongHeader : kShortHeader;
  if (packet.size() < header) return;
  const int kind = packet[4] & 0x7f;
  const std::uint64_t frame = extended ? number(packet, 8, 8) : number(packet, 2, 2);
  const Bytes body = packet.subspan(header);
  if (hasLeader_) {
    // Packets of two frames may come in turn.
    isOver_ = frame == frame_ ? kind == kTrailer : kind == kLeader;
    if (frame != frame_ || kind == kTrailer || kind == kLeader) return;
    const std::uint64_t id = extended ? number(packet, 16, 4) : number(packet, 5, 3);
    if (id == lastId_) return;  // twice
    lastId_ = id;
    ++packets_;
    largest_ = std::max(largest_, body.size());
    return;
  }
  if (kind != kLeader || body.size() < kTypeEnds) return;
  SentPicture said;
  // The bit means chunk data beside the payload; a type of the maker's own has none.
  const auto type = static_cast<unsigned>(number(body, 2, 2));
  said.payloadType = static_cast<int>(type & 0x8000U ? type : type & ~0x4000U);
  if (said.payloadType == SentPicture::kPicture || said.payloadType == SentPicture::kPictureAndChunks) {
    if (body.size() < kPictureEnds) return;
    said.format = static_cast<std::uint32_t>(number(body, 12, 4));
    said.width = side(body, 16);
    said.height = side(body, 20);
    said.x = side(body, 24);
    said.y = side(body, 28);
    said.paddingX = static_cast<int>(number(body, 32, 2));
    said.paddingY = static_cast<int>(number(body, 34, 2));
  }
  picture_ = said;
  port_ = fromPort;
  hasLeader_ = true;
  extendedIds_ = extended;
  frame_ = frame;
}

}  // namespace tractiond::capture
