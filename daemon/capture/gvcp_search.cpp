#include "daemon/capture/gvcp_search.h"

#include "base/clock.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <ctime>

namespace tractiond::capture {
namespace {

// GigE Vision 2.0, 16.1 and 28: all numbers are big-endian.
constexpr char kKey = 0x42;
constexpr char kAnswerWanted = 0x01, kMayBeBroadcast = 0x10;
constexpr char kDiscovery = 0x02;  // an answer's number is one more
constexpr std::size_t kHeader_bytes = 8, kBootstrap_bytes = 0xf8;

/// Waits for a discovery answer until a time of CLOCK_MONOTONIC [ns].
bool isAnswered(int socket, std::int64_t until_ns) {
  do {  // once also when all the time has passed while we were not running
    const std::int64_t left_ns = std::max<std::int64_t>(0, until_ns - monotonicNow());
    const timespec left{left_ns / 1'000'000'000, left_ns % 1'000'000'000};
    pollfd item{socket, POLLIN, 0};
    if (ppoll(&item, 1, &left, nullptr) <= 0) continue;
    std::array<char, 576> packet{};
    const auto got = recv(socket, packet.data(), packet.size(), 0);
    if (got >= static_cast<ssize_t>(kHeader_bytes + kBootstrap_bytes) && packet[2] == 0 && packet[3] == kDiscovery + 1)
      return true;
  } while (monotonicNow() < until_ns);
  return false;
}

}  // namespace

bool answersSearch(const std::string& address, std::chrono::milliseconds timeout, std::uint16_t port) {
  const std::int64_t begin_ns = monotonicNow(), half_ns = timeout.count() * 500'000;
  sockaddr_in camera{};
  camera.sin_family = AF_INET;
  camera.sin_port = htons(port);
  // A new port, which no other host knows: a flood at the last one does not drown the answer. The kernel drops what
  // others send than the camera.
  const int descriptor = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  bool answered = false;
  if (descriptor >= 0 && inet_pton(AF_INET, address.c_str(), &camera.sin_addr) == 1 &&
      connect(descriptor, reinterpret_cast<const sockaddr*>(&camera), sizeof camera) == 0) {
    for (char request = 1; request <= 2 && !answered; ++request) {
      const std::array<char, kHeader_bytes> packet{kKey,   kAnswerWanted | kMayBeBroadcast, 0, kDiscovery, 0, 0, 0,
                                                   request};
      send(descriptor, packet.data(), packet.size(), 0);
      answered = isAnswered(descriptor, begin_ns + request * half_ns);
    }
  }
  if (descriptor >= 0) close(descriptor);
  return answered;
}

}  // namespace tractiond::capture
