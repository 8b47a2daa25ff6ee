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

/// Instructions of a filter, which ends with take() or refuse().
class Program {
 public:
  void load(unsigned width, std::uint32_t at) { add(BPF_LD | width | BPF_ABS, at); }
  void mask(std::uint32_t bits) { add(BPF_ALU | BPF_AND | BPF_K, bits); }
  void loadPacketId(bool isExtended) {
    load(BPF_W, isExtended ? kUdpHeader + 16 : kKind);
    if (!isExtended) mask(0xffffff);
  }
  void take() { add(BPF_RET | BPF_K, kWhole); }
  void refuse() { add(BPF_RET | BPF_K, 0); }

  /// Runs `body`, which must end with take() or refuse(), if the test of what was loaded holds.
  void when(unsigned test, std::uint32_t value, auto body) {
    const std::size_t at = code_.size();
    add(BPF_JMP | test | BPF_K, value);
    body();
    code_[at].jf = static_cast<std::uint8_t>(code_.size() - at - 1);
  }
  /// Refuses the packet unless the test of what was loaded holds.
  void expect(unsigned test, std::uint32_t value) {
    add(BPF_JMP | test | BPF_K, value);
    code_.back().jt = 1;
    refuse();
  }
  void expectAtMost(std::uint32_t most) {
    when(BPF_JGT, most, [this] { refuse(); });
  }
  void expectLength(std::uint32_t least, std::uint32_t most = kWhole) {
    add(BPF_LD | BPF_W | BPF_LEN, 0);
    expect(BPF_JGE, least);
    expectAtMost(most);
  }
  /// \param port 0: any
  void expectSender(std::uint32_t address, std::uint16_t port) {
    load(BPF_W, static_cast<std::uint32_t>(SKF_NET_OFF) + 12);
    expect(BPF_JEQ, address);
    if (port == 0) return;
    load(BPF_H, 0);
    expect(BPF_JEQ, port);
  }

  std::vector<sock_filter> code() { return std::move(code_); }

 private:
  void add(unsigned code, std::uint32_t value) { code_.push_back({static_cast<std::uint16_t>(code), 0, 0, value}); }

  std::vector<sock_filter> code_;
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
  const auto takeTrailer = [&] {
    program.loadPacketId(shape.extendedIds);
    program.expect(BPF_JGE, 2);
    program.expectAtMost(blocks + 1);
    program.take();
  };
  const auto takeData = [&] {
    program.loadPacketId(shape.extendedIds);
    program.expect(BPF_JGE, 1);
    program.expectAtMost(blocks);
    const auto takeBlock = [&](std::uint32_t least) {
      program.expectLength(data + least, data + block);
      program.take();
    };
    program.when(BPF_JEQ, full + 1, [&] { takeBlock(std::max(rest, 1U)); });
    program.when(BPF_JGT, full, [&] { takeBlock(1); });
    takeBlock(block);
  };

  program.expectSender(shape.cameraAddress, shape.cameraPort);
  program.expectLength(data);
  program.load(BPF_H, kStatus);
  program.when(BPF_JSET, 0x8000, [&] {  // it cannot send a packet again
    program.load(BPF_B, kKind);
    program.when(BPF_JEQ, kTrailer | idWidth, takeTrailer);
    program.expect(BPF_JEQ, kData | idWidth);
    program.loadPacketId(shape.extendedIds);
    program.expectAtMost(blocks + 1);
    program.take();
  });
  program.load(BPF_B, kKind);
  program.when(BPF_JEQ, kData | idWidth, takeData);
  program.when(BPF_JEQ, kTrailer | idWidth, takeTrailer);
  program.expect(BPF_JEQ, kLeader | idWidth);
  program.loadPacketId(shape.extendedIds);
  program.expect(BPF_JEQ, 0);
  program.expectLength(data + kChunkLeader_bytes);
  program.load(BPF_H, data + 2);
  program.mask(0xffff & ~kChunksFollow);
  program.when(BPF_JEQ, kChunks, [&] { program.take(); });
  program.when(BPF_JEQ, kPicture, [&] {
    program.expectLength(data + kPictureLeader_bytes);
    program.take();
  });
  program.expect(BPF_JEQ, kPictureAndChunks);
  program.expectLength(data + kPictureLeader_bytes);
  program.take();
  return program.code();
}

std::vector<sock_filter> senderFilter(std::uint32_t address, std::uint16_t port) {
  Program program;
  program.expectSender(address, port);
  program.take();
  return program.code();
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
