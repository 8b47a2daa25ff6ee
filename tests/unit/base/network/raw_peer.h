// A peer that speaks ZMTP 3.0 by hand, and so can say what no ZeroMQ would.
#pragma once

#include "tests/support/deadline.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <string>

namespace tractiond::network {

class RawPeer {
 public:
  /// \param endpoint "tcp://127.0.0.1:PORT" or "ipc://PATH"
  /// \param kind of the peer's socket: "SUB", "DEALER"
  RawPeer(const std::string& endpoint, const std::string& kind)
      : RawPeer(endpoint) {
    std::string ready = "\5READY\13Socket-Type";
    ready += std::string(3, '\0') + static_cast<char>(kind.size()) + kind;
    send(greeting() + command(ready));
    receive(65);  // the other's greeting, and something of its READY
  }
  /// Connects, and sends nothing.
  explicit RawPeer(const std::string& endpoint) {
    if (endpoint.starts_with("ipc://")) {
      sockaddr_un address{AF_UNIX, {}};
      endpoint.copy(address.sun_path, sizeof address.sun_path - 1, 6);
      fd_ = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
      EXPECT_EQ(connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
      return;
    }
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<std::uint16_t>(std::stoi(endpoint.substr(endpoint.rfind(':') + 1))));
    fd_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    EXPECT_EQ(connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  }
  ~RawPeer() { close(fd_); }
  RawPeer(const RawPeer&) = delete;
  RawPeer& operator=(const RawPeer&) = delete;

  static std::string greeting() {
    std::string greeting(64, '\0');
    greeting[0] = '\xff';
    greeting[9] = '\x7f';
    greeting[10] = 3;
    greeting.replace(12, 4, "NULL");
    return greeting;
  }
  static std::string command(const std::string& body) {
    return '\4' + std::string(1, static_cast<char>(body.size())) + body;
  }
  static std::string message(const std::string& body) {
    return std::string(1, '\0') + static_cast<char>(body.size()) + body;
  }
  /// A part of a message that goes on.
  static std::string part(const std::string& body) {
    return '\1' + std::string(1, static_cast<char>(body.size())) + body;
  }

  void send(const std::string& bytes) {
    EXPECT_EQ(::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL), static_cast<ssize_t>(bytes.size()));
  }

  /// Ends the connection the hard way.
  void reset() {
    const linger hard{1, 0};
    setsockopt(fd_, SOL_SOCKET, SO_LINGER, &hard, sizeof hard);
    close(fd_);
    fd_ = -1;
  }

 private:
  void receive(std::size_t atLeast) {
    std::array<char, 256> bytes;
    for (std::size_t got = 0; got < atLeast;) {
      const ssize_t count = recv(fd_, bytes.data(), bytes.size(), 0);
      ASSERT_GT(count, 0);
      got += static_cast<std::size_t>(count);
    }
  }

  int fd_ = -1;
};

}  // namespace tractiond::network
