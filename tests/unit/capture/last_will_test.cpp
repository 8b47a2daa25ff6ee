// A camera's control port, and a process that is killed while it holds the camera.

#include "daemon/capture/last_will.h"
#include "tests/support/deadline.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <functional>
#include <string>
#include <utility>
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

/// A process that has the executor, in a process group of its own. It is killed at the latest when this object ends.
class Client {
 public:
  /// \param what it does after it has started the executor. Returns when both are done.
  explicit Client(const std::function<void()>& what) {
    std::array<int, 2> done{};
    EXPECT_EQ(pipe(done.data()), 0);
    child_ = fork();
    if (child_ == 0) {
      const rlimit noCore{0, 0};
      setrlimit(RLIMIT_CORE, &noCore);
      setpgid(0, 0);
      for (const int each : {SIGHUP, SIGINT, SIGQUIT}) std::signal(each, SIG_DFL);  // a script's job may ignore them
      if (startExecutor() != 0) _exit(1);
      what();
      if (write(done[1], "", 1) != 1) _exit(1);
      for (;;) pause();
    }
    char byte = 1;
    close(done[1]);
    EXPECT_EQ(read(done[0], &byte, 1), 1);
    close(done[0]);
  }
  ~Client() { end(SIGKILL); }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  /// \param whole whether its process group gets the signal
  void end(int signal, bool whole = false) {
    if (child_ <= 0) return;
    kill(whole ? -child_ : child_, signal);
    waitpid(std::exchange(child_, 0), nullptr, 0);
  }

 private:
  pid_t child_ = 0;
};

/// Becomes the parent of the executors that clients leave.
class LastWill : public testing::Test {
 protected:
  LastWill() { prctl(PR_SET_CHILD_SUBREAPER, 1); }
  ~LastWill() override {
    awaitExecutors();
    prctl(PR_SET_CHILD_SUBREAPER, 0);
  }
  /// Until all have ended.
  static void awaitExecutors() {
    while (waitpid(-1, nullptr, 0) > 0) {
    }
  }

  const Port camera, control;
  const std::function<void()> armed = [this] { armLastWill(control.fd(), INADDR_LOOPBACK, camera.number()); };
};

TEST_F(LastWill, KilledProcessGivesTheCameraFree) {
  Client(armed).end(SIGKILL);
  EXPECT_EQ(camera.receive(), std::pair(kRelease, control.number())) << "by the socket that holds it: others may not";
}

TEST_F(LastWill, NewestCameraIsGivenFree) {
  const Port before;
  Client([&] {
    armLastWill(control.fd(), INADDR_LOOPBACK, before.number());
    disarmLastWill(control.fd());
    armed();
  }).end(SIGKILL);
  EXPECT_EQ(camera.receive().first, kRelease);
  EXPECT_EQ(before.receive(0).first, Bytes()) << "one that was closed may be another program's by now";
}

TEST_F(LastWill, ClosedCameraIsLeftAlone) {
  Client([&] {
    armed();
    disarmLastWill(control.fd());
  }).end(SIGKILL);
  awaitExecutors();
  EXPECT_EQ(camera.receive(0).first, Bytes());
}

TEST_F(LastWill, SignalToTheGroupIsForTheProcessAlone) {
  for (const int signal : {SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGUSR1}) {
    const Port one;
    Client([&] { armLastWill(control.fd(), INADDR_LOOPBACK, one.number()); }).end(signal, true);
    awaitExecutors();
    EXPECT_EQ(one.receive(0).first, kRelease) << strsignal(signal);
  }
}

TEST_F(LastWill, WhatWasInheritedIsClosed) {
  std::array<int, 2> inherited{};
  ASSERT_EQ(pipe(inherited.data()), 0);
  Client client([&] { close(inherited[1]); });
  close(inherited[1]);
  pollfd item{inherited[0], POLLIN, 0};
  EXPECT_EQ(poll(&item, 1, test::kHung_ms), 1) << "the executor has the end that is written to";
  close(inherited[0]);
}

}  // namespace
}  // namespace tractiond::capture
