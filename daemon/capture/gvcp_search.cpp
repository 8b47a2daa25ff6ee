#include "daemon/capture/gvcp_search.h"

#include "base/clock.h"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <ctime>
#include <utility>

namespace tractiond::capture {
namespace {

using std::chrono::milliseconds;

// GigE Vision 2.0, 16.1 and 28: all numbers are big-endian.
constexpr char kKey = 0x42;
constexpr char kAnswerWanted = 0x01, kMayBeBroadcast = 0x10;
constexpr char kDiscovery = 0x02;  // an answer's number is one more
constexpr std::size_t kHeader = 8;
// In the bootstrap registers, which are the answer's body.
constexpr std::size_t kHardwareAddress = kHeader + 0x0a, kHardwareAddressSize = 6;
constexpr std::size_t kSerial = kHeader + 0xd8, kSerialSize = 16;

sockaddr_in socketAddress(const std::string& address, std::uint16_t port) {
  sockaddr_in result{};
  result.sin_family = AF_INET;
  result.sin_port = htons(port);
  inet_pton(AF_INET, address.c_str(), &result.sin_addr);
  return result;
}

}  // namespace

GvcpSearch::GvcpSearch(std::uint16_t port)
    : port_(port)
    , socket_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
  const int yes = 1;
  setsockopt(socket_, SOL_SOCKET, SO_BROADCAST, &yes, sizeof yes);
}

GvcpSearch::~GvcpSearch() {
  if (socket_ >= 0) close(socket_);
}

/// Uses a new port, which no other host knows: a flood at the last one does not drown the answer. The kernel drops what
/// others send than the camera at this address; empty: nothing.
void GvcpSearch::listenTo(const std::string& address) {
  sockaddr_in nobody{};
  nobody.sin_family = AF_UNSPEC;  // gives the port back, too
  static_cast<void>(connect(socket_, reinterpret_cast<const sockaddr*>(&nobody), sizeof nobody));
  // Answers to questions of before say nothing of now.
  std::array<char, 1> rest{};
  while (recv(socket_, rest.data(), rest.size(), 0) >= 0) {
  }
  if (address.empty()) return;
  const sockaddr_in camera = socketAddress(address, port_);
  static_cast<void>(connect(socket_, reinterpret_cast<const sockaddr*>(&camera), sizeof camera));
}

void GvcpSearch::send(const std::string& address) {
  ++request_;
  const std::array<char, kHeader> packet{kKey,
                                         kAnswerWanted | kMayBeBroadcast,
                                         0,
                                         kDiscovery,
                                         0,
                                         0,
                                         static_cast<char>(request_ >> 8),
                                         static_cast<char>(request_ & 0xff)};
  const sockaddr_in to = socketAddress(address, port_);
  sendto(socket_, packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
}

void GvcpSearch::sendToAll() {
  ifaddrs* all = nullptr;
  if (getifaddrs(&all) != 0) return;
  for (const ifaddrs* one = all; one != nullptr; one = one->ifa_next) {
    if (one->ifa_addr == nullptr || one->ifa_addr->sa_family != AF_INET) continue;
    if ((one->ifa_flags & IFF_UP) == 0 || (one->ifa_flags & IFF_BROADCAST) == 0 || one->ifa_broadaddr == nullptr)
      continue;
    std::array<char, INET_ADDRSTRLEN> text{};
    const auto* address = reinterpret_cast<const sockaddr_in*>(one->ifa_broadaddr);
    send(inet_ntop(AF_INET, &address->sin_addr, text.data(), text.size()));
  }
  freeifaddrs(all);
}

std::optional<GvcpSearch::Answer> GvcpSearch::receive(std::int64_t until_ns) {
  const std::int64_t left_ns = std::max<std::int64_t>(0, until_ns - monotonicNow());
  const timespec left{left_ns / 1'000'000'000, left_ns % 1'000'000'000};
  pollfd item{socket_, POLLIN, 0};
  if (ppoll(&item, 1, &left, nullptr) <= 0) return {};
  std::array<char, 576> packet{};
  sockaddr_in from{};
  socklen_t size = sizeof from;
  const auto got = recvfrom(socket_, packet.data(), packet.size(), 0, reinterpret_cast<sockaddr*>(&from), &size);
  const bool isAnswer = packet[2] == 0 && packet[3] == kDiscovery + 1;
  if (got < static_cast<ssize_t>(kSerial + kSerialSize) || !isAnswer || from.sin_port != htons(port_)) return {};
  Answer answer;
  std::array<char, INET_ADDRSTRLEN> text{};
  answer.address = inet_ntop(AF_INET, &from.sin_addr, text.data(), text.size());
  answer.camera.assign(packet.data() + kHardwareAddress, kHardwareAddressSize);
  answer.camera.append(packet.data() + kSerial, kSerialSize);
  return answer;
}

GvcpSearch::Identity GvcpSearch::ask(const std::string& address, milliseconds timeout) {
  const std::int64_t begin_ns = monotonicNow(), half_ns = timeout.count() * 500'000;
  listenTo(address);
  for (const std::int64_t until_ns : {begin_ns + half_ns, begin_ns + 2 * half_ns}) {
    send(address);
    do {  // once also when all the time has passed while we were not running
      auto answer = receive(until_ns);
      if (answer && answer->address == address) return std::move(answer->camera);
    } while (monotonicNow() < until_ns);
  }
  return {};
}

std::string GvcpSearch::locate(const Identity& camera, const std::string& lastAddress, milliseconds timeout,
                               const std::stop_token& stop) {
  constexpr std::int64_t kBetween_ns = 50'000'000;
  const std::int64_t end_ns = monotonicNow() + timeout.count() * 1'000'000;
  listenTo("");
  sendToAll();
  while (monotonicNow() < end_ns && !stop.stop_requested()) {
    send(lastAddress);
    const std::int64_t until_ns = monotonicNow() + kBetween_ns;
    do {
      auto answer = receive(until_ns);
      if (answer && answer->camera == camera) return std::move(answer->address);
    } while (monotonicNow() < until_ns);
  }
  return {};
}

}  // namespace tractiond::capture
