// A camera's control port, and a process that is killed while it holds the camera.

#include "daemon/capture/last_will.h"
#include "tests/support/deadline.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <functional>
#include <vector>

namespace tractiond::capture {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// "Write 0 to the control channel privilege register", as GigE Vision spells it.
const Bytes kRelease{0x42, 0x01, 0x00, 0x82, 0, 8, 0xff, 0xff, 0, 0, 0x0a, 0x00, 0, 0, 0, 0};

/// A UDP port of this host.
class Port {
 public:
  Port() {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  }
  ~Port() { close(fd_); }
  Port(const Port&) = delete;
  Port& operator=(const Port&) = delete;

  int fd() const { return fd_; }
  std::uint16_t number() const {
    sockaddr_in address{};
    socklen_t size = sizeof address;
    getsockname(fd_, reinterpret_cast<sockaddr*>(&address), &size);
    return ntohs(address.sin_port);
  }

  /// The next datagram, and the port that it came from. Empty: none comes.
  std::pair<Bytes, std::uint16_t> receive(int timeout_ms = test::kHung_ms) const {
    pollfd item{fd_, POLLIN, 0};
    if (poll(&item, 1, timeout_ms) <= 0) return {};
    Bytes bytes(100);
    sockaddr_in from{};
    socklen_t size = sizeof from;
    const ssize_t count = recvfrom(fd_, bytes.data(), bytes.size(), 0, reinterpret_cast<sockaddr*>(&from), &size);
    bytes.resize(static_cast<std::size_t>(std::max<ssize_t>(0, count)));
    return {bytes, ntohs(from.sin_port)};
  }

 private:
  int fd_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
};

/// Does something in a process of its own, which is then killed.
void doAndBeKilled(const std::function<void()>& what) {
  std::array<int, 2> done{};
  ASSERT_EQ(pipe(done.data()), 0);
  const pid_t child = fork();
  if (child == 0) {
    if (startExecutor() != 0) _exit(1);
    what();
    if (write(done[1], "", 1) != 1) _exit(1);
    for (;;) pause();
  }
  char byte = 1;
  close(done[1]);
  EXPECT_EQ(read(done[0], &byte, 1), 1);
  close(done[0]);
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
}

TEST(LastWill, KilledProcessGivesTheCameraFree) {
  const Port camera, control;
  doAndBeKilled([&] { armLastWill(control.fd(), INADDR_LOOPBACK, camera.number()); });
  EXPECT_EQ(camera.receive(), std::pair(kRelease, control.number())) << "by the socket that holds it: others may not";
}

TEST(LastWill, NewestCameraIsGivenFree) {
  const Port before, camera, control;
  doAndBeKilled([&] {
    armLastWill(control.fd(), INADDR_LOOPBACK, before.number());
    disarmLastWill(control.fd());
    armLastWill(control.fd(), INADDR_LOOPBACK, camera.number());
  });
  EXPECT_EQ(camera.receive().first, kRelease);
  EXPECT_EQ(before.receive(0).first, Bytes()) << "one that was closed may be another program's by now";
}

TEST(LastWill, ClosedCameraIsLeftAlone) {
  const Port camera, control;
  std::array<int, 2> alive{};  // the executor has the end that is written to until it has ended
  ASSERT_EQ(pipe(alive.data()), 0);
  doAndBeKilled([&] {
    armLastWill(control.fd(), INADDR_LOOPBACK, camera.number());
    disarmLastWill(control.fd());
  });
  close(alive[1]);
  char byte = 0;
  EXPECT_EQ(read(alive[0], &byte, 1), 0);
  close(alive[0]);
  EXPECT_EQ(camera.receive(0).first, Bytes());
}

}  // namespace
}  // namespace tractiond::capture
