#include "base/network/frame_meter.h"

#include <algorithm>

namespace tractiond::network {
namespace {

constexpr std::uint8_t kMore = 1, kLong = 2, kCommand = 4;
constexpr std::size_t kSignatureEnd = 9, kMajorVersion = 10;

// Memory that libzmq 4.3.4 allocates [bytes].
constexpr std::uint64_t kMessage = 64;        ///< of a queue, for a part
constexpr std::uint64_t kWithinMessage = 33;  ///< bytes of a part's body that need no memory besides
constexpr std::uint64_t kReadBuffer = 8192;   ///< kept as long as any part of what was read into it
constexpr std::uint64_t kBranch = 2048;       ///< a table of 256 pointers, where a subscription leaves the others' path
constexpr std::uint64_t kNode = 40;           ///< of the tree of subscriptions, for each byte of a topic
constexpr std::uint64_t kLargestBody = 1 << 24;  ///< counted; ZMQ_MAXMSGSIZE is far below

constexpr std::uint64_t kLargestTransient = 512;  ///< bytes of a command of a handshake

/// Commands that ZeroMQ keeps nothing of, by the lengths of their names: PING and PONG, HELLO, READY and ERROR,
/// INITIATE.
bool isTransient(std::uint8_t nameLength) {
  return nameLength == 4 || nameLength == 5 || nameLength == 8;
}

}  // namespace

FrameMeter::Reading FrameMeter::read(std::span<const std::uint8_t> bytes, Charge charge) {
  Reading reading;
  bool pinned = false;
  const std::uint8_t* at = bytes.data();
  const std::uint8_t* const end = at + bytes.size();
  for (; at != end && greeting_ < kGreeting; ++at, ++greeting_) {
    isOld_ = isOld_ || (greeting_ == 0 && *at != 0xff) || (greeting_ == kSignatureEnd && (*at & 1) == 0) ||
             (greeting_ == kMajorVersion && *at < 3);
  }
  reading.isOld = isOld_;
  if (isOld_) return reading;
  while (at != end) {
    if (undecided_) {
      undecided_ = false;
      if (!isTransient(*at)) count(reading, charge, pinned);
    }
    if (left_ > 0) {
      const auto skipped = std::min<std::uint64_t>(left_, static_cast<std::uint64_t>(end - at));
      left_ -= skipped;
      at += skipped;
      continue;
    }
    header_[headerSize_++] = *at++;
    const std::uint8_t flags = header_[0];
    if (headerSize_ < ((flags & kLong) != 0 ? 9U : 2U)) continue;
    body_ = 0;
    for (std::size_t i = 1; i < headerSize_; ++i) body_ = body_ << 8 | header_[i];
    headerSize_ = 0;
    left_ = body_;
    undecided_ = (flags & (kCommand | kMore)) == kCommand && body_ > 0 && body_ <= kLargestTransient;
    if (!undecided_) count(reading, charge, pinned);
  }
  if (pinned) reading.cost_bytes += kReadBuffer;
  return reading;
}

void FrameMeter::count(Reading& reading, Charge charge, bool& pinned) const {
  ++reading.frames;
  const std::uint64_t body = std::min(body_, kLargestBody);
  reading.cost_bytes += kMessage + (charge == Charge::kSubscriptions ? kBranch + kNode * body : body);
  pinned = pinned || body > kWithinMessage;
}

}  // namespace tractiond::network
