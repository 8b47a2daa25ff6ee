#include "tests/unit/capture/gv_transmitter.h"

#include "base/clock.h"

#include <arpa/inet.h>
#include <arv.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <stdexcept>

namespace tractiond::test {
namespace {

constexpr std::uint32_t kUserSetLoad = 0x224, kControl = 0x0a00, kAccessDenied = 0x8006, kPacketUnavailable = 0x800c;
constexpr std::uint32_t kTicksPerSecond = 0x0940, kClockControl = 0x0944, kClockValue = 0x0948;
constexpr std::uint32_t kStreamPort = 0x0d00, kPacketSize = 0x0d04, kStreamAddress = 0x0d18, kSourcePort = 0x0d1c;

using Bytes = std::vector<std::uint8_t>;

void put(Bytes& bytes, std::uint64_t value, int size) {
  for (int i = size - 1; i >= 0; --i) bytes.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}
std::uint32_t take(const std::uint8_t* bytes, int size) {
  std::uint32_t value = 0;
  for (int i = 0; i < size; ++i) value = value << 8 | bytes[i];
  return value;
}

}  // namespace

GvTransmitter::GvTransmitter(const std::string& description)
    : camera_(arv_fake_camera_new_full("T01", description.c_str()))
    , control_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0))
    , stream_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_port = htons(3956);
  at.sin_addr.s_addr = htonl(INADDR_ANY);
  if (bind(control_, reinterpret_cast<const sockaddr*>(&at), sizeof at) != 0)
    throw std::runtime_error("port 3956 is taken");
  at.sin_port = 0;
  at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof at;
  if (bind(stream_, reinterpret_cast<const sockaddr*>(&at), size) != 0 ||
      getsockname(stream_, reinterpret_cast<sockaddr*>(&at), &size) != 0)
    throw std::runtime_error("no port to send from");
  write(kSourcePort, ntohs(at.sin_port));
  std::array<char, 32> name{};
  std::strcpy(name.data(), "Tractiond");
  arv_fake_camera_write_memory(camera_, 0x48, 32, name.data());
  std::strcpy(name.data(), "Quirky");
  arv_fake_camera_write_memory(camera_, 0x68, 32, name.data());
  write(0x24, INADDR_LOOPBACK);  // its current address
  write(0x093c, 0);              // ticks per second, both halves: 10^9
  write(0x0940, 1'000'000'000);
  thread_ = std::thread([this] { serve(); });
}

GvTransmitter::~GvTransmitter() {
  ending_ = true;
  thread_.join();
  close(control_);
  close(stream_);
  g_object_unref(camera_);
}

std::uint32_t GvTransmitter::read(std::uint32_t address) const {
  std::uint32_t value = 0;
  arv_fake_camera_read_register(camera_, address, &value);
  return value;
}

void GvTransmitter::write(std::uint32_t address, std::uint32_t value) {
  arv_fake_camera_write_register(camera_, address, value);
}

std::uint64_t GvTransmitter::ticks() const {
  const auto elapsed_ns = static_cast<double>(rawNow() - clockSet_ns_);
  const double shows_ns = static_cast<double>(clockShowed_ns_) + elapsed_ns * (1 + clockRate);
  return static_cast<std::uint64_t>(shows_ns * 1e-9 * read(kTicksPerSecond));
}

void GvTransmitter::setClock(std::int64_t shows_ns) {
  clockShowed_ns_ = shows_ns;
  clockSet_ns_ = rawNow();
}

bool GvTransmitter::streaming() const {
  return read(0x124) == 1 && read(kStreamPort) != 0;
}

/// GigE Vision control protocol: command, size, id; the answer's command is one more.
void GvTransmitter::serve() {
  using Clock = std::chrono::steady_clock;
  Clock::time_point done = Clock::time_point::max();
  std::uint64_t controller = 0;  // address and port; what a client before left behind may still write
  while (!ending_) {
    if (Clock::now() >= done) {
      write(kUserSetLoad, 0);
      done = Clock::time_point::max();
    }
    pollfd item{control_, POLLIN, 0};
    if (poll(&item, 1, 5) <= 0) continue;
    std::array<std::uint8_t, 1024> in{};
    sockaddr_in from{};
    socklen_t fromSize = sizeof from;
    const ssize_t got = recvfrom(control_, in.data(), in.size(), 0, reinterpret_cast<sockaddr*>(&from), &fromSize);
    if (got < 8 || in[0] != 0x42 || hanging_) continue;
    const std::uint32_t command = take(&in[2], 2), id = take(&in[6], 2);
    const std::uint64_t sender = std::uint64_t{from.sin_addr.s_addr} << 16 | from.sin_port;
    const bool writes = command == 0x82 || command == 0x86;
    if ((command == 0x80 || command == 0x82) && hangsAt != 0 && take(&in[8], 4) == hangsAt) {
      hanging_ = true;
      continue;
    }
    const bool locked = locksAt != 0 && got >= 12 && take(&in[8], 4) == locksAt;
    const bool denied = writes && (locked || (controller != 0 && controller != sender));
    if (command == 0x82 && !denied && take(&in[8], 4) == kControl) controller = take(&in[12], 4) == 0 ? 0 : sender;
    Bytes answer;
    if (command == 0x40) {  // packets once more; it has no answer
      if (resends && got >= 20)
        sendAgain(static_cast<std::uint16_t>(take(&in[8], 4)), take(&in[12], 4), take(&in[16], 4));
      continue;
    }
    switch (denied ? 0 : command) {
    case 0:
      break;
    case 0x02: {  // discovery
      answer.resize(0xf8);
      arv_fake_camera_read_memory(camera_, 0, 0xf8, answer.data());
      break;
    }
    case 0x80:
      put(answer, read(take(&in[8], 4)), 4);
      break;
    case 0x82: {
      const std::uint32_t address = take(&in[8], 4), value = take(&in[12], 4);
      if (address != ignoresAt) write(address, value);
      if (address == kClockControl && (value & 2U) != 0) {
        const std::uint64_t latched = ticks();
        write(kClockValue, static_cast<std::uint32_t>(latched >> 32));
        write(kClockValue + 4, static_cast<std::uint32_t>(latched));
      }
      if (address == kUserSetLoad && value == 1) {
        write(0x110, 0);  // what it loads
        write(0x210, 11);
        done = Clock::now() + std::chrono::milliseconds(commandTakes_ms.load());
      }
      put(answer, 0, 2);
      put(answer, 1, 2);
      break;
    }
    case 0x84: {
      const std::uint32_t address = take(&in[8], 4), size = take(&in[14], 2);
      put(answer, address, 4);
      answer.resize(4 + size);
      arv_fake_camera_read_memory(camera_, address, size, answer.data() + 4);
      break;
    }
    case 0x86: {
      const std::uint32_t address = take(&in[8], 4);
      if (address != ignoresAt)
        arv_fake_camera_write_memory(camera_, address, static_cast<std::uint32_t>(got - 12), &in[12]);
      put(answer, 0, 2);
      put(answer, static_cast<std::uint64_t>(got - 12), 2);
      break;
    }
    default:
      continue;
    }
    Bytes out;
    put(out, denied ? kAccessDenied : 0, 2);
    put(out, command + 1, 2);
    put(out, answer.size(), 2);
    put(out, id, 2);
    out.insert(out.end(), answer.begin(), answer.end());
    sendto(control_, out.data(), out.size(), 0, reinterpret_cast<const sockaddr*>(&from), fromSize);
  }
}

GvTransmitter::Packets GvTransmitter::packetsOf(const Picture& picture) const {
  Packets packets;
  const auto begin = [&](std::uint8_t kind) {
    Bytes bytes;
    put(bytes, 0, 2);
    put(bytes, picture.id, 2);
    put(bytes, kind, 1);
    put(bytes, packets.size(), 3);
    return bytes;
  };
  Bytes leader = begin(1);
  put(leader, 0, 2);
  put(leader, picture.payloadType, 2);
  put(leader, picture.device_ticks, 8);
  if ((picture.payloadType & 0x3fff) != 4) {
    put(leader, picture.format, 4);
    for (const int side : {picture.width, picture.height, picture.x, picture.y})
      put(leader, static_cast<std::uint64_t>(side), 4);
    for (const int padding : {picture.paddingX, picture.paddingY}) put(leader, static_cast<std::uint64_t>(padding), 2);
  }
  packets.push_back(std::move(leader));
  const std::size_t asked = (read(kPacketSize) & 0xffff) - 36;
  const std::size_t block = asked - asked % static_cast<std::size_t>(roundsTo_bytes);
  for (std::size_t at = 0; at < picture.bytes.size(); at += block) {
    Bytes payload = begin(picture.dataKind);
    const std::size_t size = std::min(block, picture.bytes.size() - at);
    payload.insert(payload.end(), picture.bytes.begin() + static_cast<std::ptrdiff_t>(at),
                   picture.bytes.begin() + static_cast<std::ptrdiff_t>(at + size));
    packets.push_back(std::move(payload));
  }
  Bytes trailer = begin(2);
  put(trailer, 0, 2);
  put(trailer, picture.payloadType, 2);
  put(trailer, static_cast<std::uint64_t>(picture.height), 4);
  packets.push_back(std::move(trailer));
  return packets;
}

void GvTransmitter::send(const Picture& picture) {
  constexpr std::size_t kRemembered = 8;
  Packets packets = packetsOf(picture);
  {
    const std::lock_guard lock(sending_);
    if (sent_.size() == kRemembered) sent_.pop_front();
    sent_.emplace_back(picture.id, Packets());
  }
  for (std::size_t number = 0; number < packets.size(); ++number) {
    if (pace) pace(number, packets.size());
    const std::lock_guard lock(sending_);
    sendOne(packets[number]);
    if (resends) sent_.back().second.push_back(std::move(packets[number]));
  }
}

void GvTransmitter::sendOne(const Bytes& packet) {
  if (std::uniform_real_distribution<double>()(fate_) < loss) return;
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(read(kStreamPort)));
  to.sin_addr.s_addr = htonl(read(kStreamAddress));
  sendto(stream_, packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
}

void GvTransmitter::sendAgain(std::uint16_t id, std::uint32_t first, std::uint32_t last) {
  const std::lock_guard lock(sending_);
  const auto frame = std::ranges::find(sent_, id, &std::pair<std::uint16_t, Packets>::first);
  for (std::uint32_t number = first; number <= last; ++number) {
    if (frame != sent_.end() && number < frame->second.size()) {
      sendOne(frame->second[number]);
    } else if (saysUnavailable) {
      Bytes bytes;
      put(bytes, kPacketUnavailable, 2);
      put(bytes, id, 2);
      put(bytes, 3, 1);
      put(bytes, number, 3);
      sendOne(bytes);
    }
  }
}

}  // namespace tractiond::test
