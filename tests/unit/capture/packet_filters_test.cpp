// Datagrams of all kinds through a socket of the kernel's, against what GigE Vision says a camera may send, written
// here once more and differently: as a reader of packets, not as a program for the kernel.
#include "daemon/capture/stream_filter.h"
#include "tests/support/seed.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <initializer_list>
#include <random>

namespace tractiond::capture::packet_filters_test {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr std::uint32_t kCamera = 0x7f000001, kStranger = 0x7f000002;

struct Packet {
  Bytes bytes;
  std::uint32_t from = kCamera;
  bool fromItsPort = true;
};

std::uint64_t number(const Bytes& bytes, std::size_t at, std::size_t width) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < width; ++i) value = value << 8 | (at + i < bytes.size() ? bytes[at + i] : 0);
  return value;
}

void put(Bytes& bytes, std::size_t at, std::size_t width, std::uint64_t value) {
  for (std::size_t i = 0; i < width && at + i < bytes.size(); ++i)
    bytes[at + i] = static_cast<std::uint8_t>(value >> 8 * (width - 1 - i));
}

/// By the standard, and by what Aravis can bear.
bool mayPass(const Packet& packet, const StreamShape& shape) {
  const Bytes& bytes = packet.bytes;
  const std::size_t header = shape.extendedIds ? 20 : 8;
  const std::size_t blockSize = static_cast<std::size_t>(shape.packetSize_bytes) - 20 - 8 - header;
  std::uint64_t blocks = 0;
  for (std::size_t left = shape.payload_bytes; left > 0; left -= std::min(left, blockSize)) ++blocks;
  if (packet.from != shape.cameraAddress || (shape.cameraPort != 0 && !packet.fromItsPort)) return false;
  if (bytes.size() < header) return false;
  if ((bytes[4] >> 7 != 0) != shape.extendedIds) return false;
  const int format = bytes[4] & 0x7f;
  const std::uint64_t id = shape.extendedIds ? number(bytes, 16, 4) : number(bytes, 5, 3);
  const std::size_t body = bytes.size() - header;
  const bool error = bytes[0] >= 0x80;
  if (format == 2) return id >= 2 && id <= blocks + 1;
  if (format == 3 && error) return id <= blocks + 1;
  if (format == 3) {
    // The picture's part of this block, which must not have a hole.
    const std::uint64_t before = (id - 1) * blockSize;
    const std::uint64_t needed =
        shape.picture_bytes > before ? std::min<std::uint64_t>(shape.picture_bytes - before, blockSize) : 0;
    return id >= 1 && id <= blocks && body >= std::max<std::uint64_t>(needed, 1) && body <= blockSize;
  }
  if (format != 1 || error || id != 0) return false;
  const std::uint64_t type = number(bytes, header + 2, 2) & ~std::uint64_t{0x4000};
  return (type == 4 && body >= 12) || ((type == 1 || type == 5) && body >= 36);
}

class PacketFilters : public testing::Test {
 protected:
  PacketFilters()
      : receiver_(bound(kCamera))
      , camera_(bound(kCamera))
      , other_(bound(kCamera))
      , stranger_(bound(kStranger))
      , random_(test::seed()) {}
  ~PacketFilters() override {
    for (const int one : {receiver_, camera_, other_, stranger_}) close(one);
  }

  static int bound(std::uint32_t address) {
    const int descriptor = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    sockaddr_in here = {};
    here.sin_family = AF_INET;
    here.sin_addr.s_addr = htonl(address);
    EXPECT_EQ(bind(descriptor, reinterpret_cast<sockaddr*>(&here), sizeof here), 0) << std::strerror(errno);
    return descriptor;
  }
  static sockaddr_in addressOf(int descriptor) {
    sockaddr_in address = {};
    socklen_t length = sizeof address;
    getsockname(descriptor, reinterpret_cast<sockaddr*>(&address), &length);
    return address;
  }
  std::uint64_t between(std::uint64_t least, std::uint64_t most) {
    return std::uniform_int_distribution<std::uint64_t>(least, most)(random_);
  }
  std::uint64_t oneOf(std::initializer_list<std::uint64_t> of) { return *(of.begin() + between(0, of.size() - 1)); }
  bool chance(int percent) { return between(1, 100) <= static_cast<std::uint64_t>(percent); }

  StreamShape drawShape() {
    StreamShape shape;
    shape.cameraAddress = kCamera;
    shape.cameraPort = chance(70) ? ntohs(addressOf(camera_).sin_port) : std::uint16_t{0};
    shape.packetSize_bytes = static_cast<int>(between(100, 9000));
    shape.payload_bytes = between(1, chance(30) ? 3000 : 30'000'000);
    shape.picture_bytes = chance(20) ? 0 : chance(50) ? shape.payload_bytes : between(0, shape.payload_bytes);
    shape.extendedIds = chance(40);
    return shape;
  }
  void attach(std::vector<sock_filter> code) {
    const sock_fprog program{static_cast<unsigned short>(code.size()), code.data()};
    ASSERT_EQ(setsockopt(receiver_, SOL_SOCKET, SO_ATTACH_FILTER, &program, sizeof program), 0) << std::strerror(errno);
  }

  /// Near what is right: every number is often at its limit or one beside it.
  Packet drawPacket(const StreamShape& shape) {
    const std::size_t header = static_cast<std::size_t>(chance(95) ? shape.headerBytes() : 28 - shape.headerBytes());
    const std::uint64_t blocks = shape.blocks(), block = static_cast<std::uint64_t>(shape.blockBytes());
    const std::uint64_t full = shape.picture_bytes / block;
    const int format = chance(90) ? static_cast<int>(between(1, 3)) : static_cast<int>(between(0, 127));
    const std::uint64_t rest = shape.picture_bytes % block;
    Packet packet;
    packet.bytes.resize(header + oneOf({0, 1, 11, 12, 35, 36, 60, block - 1, block, block, block, block + 1, rest,
                                        rest + 1, between(0, block + 40)}));
    if (chance(5)) packet.bytes.resize(between(0, header));
    for (std::uint8_t& byte : packet.bytes) byte = static_cast<std::uint8_t>(random_());
    put(packet.bytes, 0, 2, oneOf({0, 0, 0, 0x0100, 0x800c, 0x8000, between(0, 0xffff)}));
    const std::uint64_t id =
        oneOf({0, 0, 1, 2, 3, blocks, blocks + 1, blocks + 2, blocks - 1, between(0, blocks + 3), full, full + 1,
               full + 2, 0xfffffffe, 0xffffffff, 0xfffffe, 0x01000000, between(0, 0xffffffff)});
    const bool extended = chance(95) ? shape.extendedIds : !shape.extendedIds;
    put(packet.bytes, 4, 1, static_cast<std::uint64_t>(format) | (extended ? 0x80U : 0U));
    put(packet.bytes, 5, 3, id);
    if (extended) put(packet.bytes, 16, 4, id);
    if (format == 1)
      put(packet.bytes, header + 2, 2,
          oneOf({1, 1, 1, 0x4001, 4, 5, 0x4005, 2, 7, 0x8001, 0x8007, between(0, 0xffff)}));
    packet.from = chance(90) ? kCamera : kStranger;
    packet.fromItsPort = packet.from == kCamera && chance(90);
    return packet;
  }

  bool passes(const Packet& packet) {
    const sockaddr_in to = addressOf(receiver_);
    const int from = packet.from == kStranger ? stranger_ : packet.fromItsPort ? camera_ : other_;
    const auto size = static_cast<ssize_t>(packet.bytes.size());
    EXPECT_EQ(
        sendto(from, packet.bytes.data(), packet.bytes.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to),
        size);
    // On the loopback it is there when sendto() is back.
    Bytes got(packet.bytes.size() + 1);
    const ssize_t came = recv(receiver_, got.data(), got.size(), MSG_DONTWAIT);
    if (came < 0) return false;
    got.resize(static_cast<std::size_t>(came));
    EXPECT_EQ(got, packet.bytes) << "cut";
    return true;
  }

  int receiver_, camera_, other_, stranger_;
  std::mt19937_64 random_;
};

TEST_F(PacketFilters, TheStreamTakesWhatItsCameraCanSendAndNothingElse) {
  int passed = 0, refused = 0;
  for (int i = 0; i < 200 && !HasFailure(); ++i) {
    const StreamShape shape = drawShape();
    attach(streamFilter(shape));
    for (int j = 0; j < 300; ++j) {
      const Packet packet = drawPacket(shape);
      const bool may = mayPass(packet, shape);
      ++(may ? passed : refused);
      ASSERT_EQ(passes(packet), may) << testing::PrintToString(packet.bytes)
                                     << (packet.fromItsPort ? "" : " from elsewhere") << "; packets of "
                                     << shape.packetSize_bytes << " bytes, payload of " << shape.payload_bytes
                                     << (shape.extendedIds ? ", extended ids" : "");
    }
  }
  EXPECT_GT(passed, 3000);
  EXPECT_GT(refused, 3000);
}

TEST_F(PacketFilters, TheControlChannelTakesWhatItsCameraSendsAndNothingElse) {
  attach(senderFilter(kCamera, ntohs(addressOf(camera_).sin_port)));
  EXPECT_TRUE(passes({.bytes = Bytes(8)}));
  EXPECT_FALSE(passes({.bytes = Bytes(8), .fromItsPort = false}));
  EXPECT_FALSE(passes({.bytes = Bytes(8), .from = kStranger, .fromItsPort = false}));
}

}  // namespace
}  // namespace tractiond::capture::packet_filters_test
