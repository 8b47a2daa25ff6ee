#include "daemon/capture/stream_filter.h"

#include <algorithm>
#include <utility>

namespace tractiond::capture {
namespace {

constexpr std::uint32_t kUdpHeader = 8;  // where a socket's filter sees the packet begin
constexpr std::uint32_t kStatus = kUdpHeader, kKind = kUdpHeader + 4;
constexpr std::uint32_t kLeader = 1, kTrailer = 2, kData = 3, kExtendedIds = 0x80;
constexpr std::uint32_t kWhole = 0xffffffff;
// Payload types: a picture, chunk data alone, a picture whose chunk data has a format of its own.
constexpr std::uint32_t kPicture = 1, kChunks = 4, kPictureAndChunks = 5, kChunksFollow = 0x4000;
constexpr std::uint32_t kChunkLeader_bytes = 12, kPictureLeader_bytes = 36;

/// Instructions with names for where they jump; resolved once all are there.
class Program {
 public:
  enum Label {
    kNext,
    kRefuse,
    kTake,
    kTrailerFollows,
    kDataFollows,
    kErrorFollows,
    kPictureFollows,
    kTailFollows,
    kLastFollows,
    kLabels
  };

  void load(std::uint16_t width, std::uint32_t at) { add(BPF_LD | width | BPF_ABS, at); }
  void mask(std::uint32_t bits) { add(BPF_ALU | BPF_AND | BPF_K, bits); }
  void jump(std::uint16_t test, std::uint32_t value, Label yes, Label no) {
    jumps_.push_back({code_.size(), yes, no});
    add(static_cast<std::uint16_t>(BPF_JMP | test | BPF_K), value);
  }
  void here(Label label) { places_[label] = code_.size(); }

  void loadPacketId(bool isExtended) {
    load(BPF_W, isExtended ? kUdpHeader + 16 : kKind);
    if (!isExtended) mask(0xffffff);
  }
  void expectLength(std::uint32_t least, std::uint32_t most, Label then) {
    add(BPF_LD | BPF_W | BPF_LEN, 0);
    jump(BPF_JGE, least, kNext, kRefuse);
    jump(BPF_JGT, most, kRefuse, then);
  }
  void expectSender(std::uint32_t address, Label then) {
    load(BPF_W, static_cast<std::uint32_t>(SKF_NET_OFF) + 12);
    jump(BPF_JEQ, address, then, kRefuse);
  }

  std::vector<sock_filter> resolved() {
    here(kTake);
    add(BPF_RET | BPF_K, kWhole);
    here(kRefuse);
    add(BPF_RET | BPF_K, 0);
    for (const Jump& jump : jumps_) {
      const auto distance = [&](Label label) {
        return static_cast<std::uint8_t>(label == kNext ? 0 : places_[label] - jump.at - 1);
      };
      code_[jump.at].jt = distance(jump.yes);
      code_[jump.at].jf = distance(jump.no);
    }
    return std::move(code_);
  }

 private:
  struct Jump {
    std::size_t at;
    Label yes, no;
  };
  void add(std::uint16_t code, std::uint32_t value) { code_.push_back({code, 0, 0, value}); }

  std::vector<sock_filter> code_;
  std::vector<Jump> jumps_;
  std::size_t places_[kLabels] = {};
};

}  // namespace

std::vector<sock_filter> streamFilter(const StreamShape& shape) {
  const std::uint32_t data = kUdpHeader + static_cast<std::uint32_t>(shape.headerBytes());
  const std::uint32_t idWidth = shape.extendedIds ? kExtendedIds : 0;
  const std::uint32_t blocks = shape.blocks(), block = static_cast<std::uint32_t>(shape.blockBytes());
  // Blocks that the picture fills, and its bytes in the next.
  const auto full = static_cast<std::uint32_t>(shape.picture_bytes / block);
  const auto rest = static_cast<std::uint32_t>(shape.picture_bytes % block);
  Program program;

  // From any sender.
  program.expectSender(shape.cameraAddress, Program::kNext);
  if (shape.cameraPort != 0) {
    program.load(BPF_H, 0);
    program.jump(BPF_JEQ, shape.cameraPort, Program::kNext, Program::kRefuse);
  }
  program.expectLength(data, kWhole, Program::kNext);
  program.load(BPF_H, kStatus);
  program.jump(BPF_JSET, 0x8000, Program::kErrorFollows, Program::kNext);
  program.load(BPF_B, kKind);
  program.jump(BPF_JEQ, kData | idWidth, Program::kDataFollows, Program::kNext);
  program.jump(BPF_JEQ, kTrailer | idWidth, Program::kTrailerFollows, Program::kNext);
  program.jump(BPF_JEQ, kLeader | idWidth, Program::kNext, Program::kRefuse);

  program.loadPacketId(shape.extendedIds);
  program.jump(BPF_JEQ, 0, Program::kNext, Program::kRefuse);
  program.expectLength(data + kChunkLeader_bytes, kWhole, Program::kNext);
  program.load(BPF_H, data + 2);
  program.mask(0xffff & ~kChunksFollow);
  program.jump(BPF_JEQ, kPicture, Program::kPictureFollows, Program::kNext);
  program.jump(BPF_JEQ, kPictureAndChunks, Program::kPictureFollows, Program::kNext);
  program.jump(BPF_JEQ, kChunks, Program::kTake, Program::kRefuse);
  program.here(Program::kPictureFollows);
  program.expectLength(data + kPictureLeader_bytes, kWhole, Program::kTake);

  program.here(Program::kErrorFollows);
  program.load(BPF_B, kKind);
  program.jump(BPF_JEQ, kTrailer | idWidth, Program::kTrailerFollows, Program::kNext);
  program.jump(BPF_JEQ, kData | idWidth, Program::kNext, Program::kRefuse);
  program.loadPacketId(shape.extendedIds);
  program.jump(BPF_JGT, blocks + 1, Program::kRefuse, Program::kTake);

  program.here(Program::kTrailerFollows);
  program.loadPacketId(shape.extendedIds);
  program.jump(BPF_JGE, 2, Program::kNext, Program::kRefuse);
  program.jump(BPF_JGT, blocks + 1, Program::kRefuse, Program::kTake);

  program.here(Program::kDataFollows);
  program.loadPacketId(shape.extendedIds);
  program.jump(BPF_JGE, 1, Program::kNext, Program::kRefuse);
  program.jump(BPF_JGT, blocks, Program::kRefuse, Program::kNext);
  program.jump(BPF_JGT, full, Program::kTailFollows, Program::kNext);
  program.expectLength(data + block, data + block, Program::kTake);
  program.here(Program::kTailFollows);
  program.jump(BPF_JEQ, full + 1, Program::kLastFollows, Program::kNext);
  program.expectLength(data + 1, data + block, Program::kTake);
  program.here(Program::kLastFollows);
  program.expectLength(data + std::max(rest, 1U), data + block, Program::kTake);

  return program.resolved();
}

std::vector<sock_filter> senderFilter(std::uint32_t address) {
  Program program;
  program.expectSender(address, Program::kTake);
  return program.resolved();
}

int evenPacketSize(int largest, int headers_bytes, int least, int increment) {
  constexpr int kEven_bytes = 64;
  const int allowed = largest - (largest - least) % increment;
  // Sizes that divide well come again after `increment` * 64 bytes at the latest.
  const int lowest = std::max(least, allowed - increment * kEven_bytes);
  for (int size = allowed; size >= lowest && size > headers_bytes; size -= increment)
    if ((size - headers_bytes) % kEven_bytes == 0) return size;
  return allowed;
}

}  // namespace tractiond::capture
