#include "daemon/capture/last_will.h"

#include <fcntl.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <mutex>

namespace tractiond::capture {
namespace {

/// GigE Vision's control protocol: write 0 to the control channel privilege register.
constexpr std::array<std::uint8_t, 16> kRelease{0x42, 0x01, 0x00, 0x82, 0, 8, 0xff, 0xff, 0, 0, 0x0a, 0x00, 0, 0, 0, 0};

/// What the executor is told: a camera, with the socket by which it is controlled; or without one, that it is closed.
struct Order {
  std::uint32_t address;
  std::uint16_t port;
};

struct Will {
  std::mutex mutex;   ///< guards writing
  int executor = -1;  ///< leads to it
  int socket = -1;    ///< of the camera that was armed last
};

Will& will() {
  static Will one;
  return one;
}

void giveFree(int socket, std::uint32_t address, std::uint16_t port) {
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_addr.s_addr = htonl(address);
  to.sin_port = htons(port);
  sendto(socket, kRelease.data(), kRelease.size(), MSG_DONTWAIT, reinterpret_cast<const sockaddr*>(&to), sizeof to);
}

/// An order on its way, and room for one descriptor.
struct Letter {
  Order order{};
  iovec bytes{&order, sizeof order};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(int))> room{};
  msghdr header{nullptr, 0, &bytes, 1, room.data(), room.size(), 0};
};

/// Does not wait. \param socket -1: the camera is closed
void tellExecutor(int executor, const Order& order, int socket) {
  if (executor < 0) return;
  Letter letter;
  letter.order = order;
  if (socket >= 0) {
    cmsghdr* const rights = CMSG_FIRSTHDR(&letter.header);
    rights->cmsg_level = SOL_SOCKET;
    rights->cmsg_type = SCM_RIGHTS;
    rights->cmsg_len = CMSG_LEN(sizeof socket);
    std::memcpy(CMSG_DATA(rights), &socket, sizeof socket);
  } else {
    letter.header.msg_control = nullptr;
    letter.header.msg_controllen = 0;
  }
  sendmsg(executor, &letter.header, MSG_DONTWAIT | MSG_NOSIGNAL);
}

/// What the executor does: keeps the newest order until the other process has ended, and carries it out then.
/// Allocates nothing, as the other process may have had threads. Takes no signal: it is started with all of them
/// blocked. \param orders ends with the other process
[[noreturn]] void liveAsExecutor(int orders) {
  constexpr int kTimes = 3, kBetween_ms = 5;  // a datagram may be lost
  constexpr int kOrders = STDERR_FILENO + 1;
  prctl(PR_SET_NAME, "tr-last-will");
  // Closes all else that was inherited: a reader of one of the other process's pipes waits until the last writer closes
  // it.
  if (orders != kOrders) dup2(orders, kOrders);
  close_range(kOrders + 1, ~0U, 0);
  if (const int nothing = open("/dev/null", O_RDWR); nothing >= 0) {
    for (const int standard : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) dup2(nothing, standard);
    if (nothing > kOrders) close(nothing);  // else it is a standard one that was closed
  }
  int socket = -1;
  Order last{};
  for (;;) {
    Letter letter;
    const ssize_t got = recvmsg(kOrders, &letter.header, MSG_CMSG_CLOEXEC);
    if (got < 0 && errno == EINTR) continue;
    if (got != sizeof(Order)) break;
    if (socket >= 0) close(socket);
    socket = -1;
    last = letter.order;
    if (const cmsghdr* const rights = CMSG_FIRSTHDR(&letter.header); rights != nullptr)
      std::memcpy(&socket, CMSG_DATA(rights), sizeof socket);
  }
  for (int i = 0; socket >= 0 && i < kTimes; ++i) {
    giveFree(socket, last.address, last.port);
    poll(nullptr, 0, kBetween_ms);
  }
  _exit(0);
}

}  // namespace

int startExecutor() {
  std::array<int, 2> ends{};
  if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()) != 0) return errno;
  // A signal to the whole group (a terminal's, a watchdog's of systemd) is meant for this process alone.
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_BLOCK, &all, &before);
  const pid_t child = fork();
  if (child == 0) {
    close(ends[0]);
    liveAsExecutor(ends[1]);
  }
  const int why = child < 0 ? errno : 0;
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  close(ends[1]);
  if (why != 0) {
    close(ends[0]);
    return why;
  }
  const std::lock_guard lock(will().mutex);
  will().executor = ends[0];
  return 0;
}

void armLastWill(int socket, std::uint32_t address, std::uint16_t port) {
  const std::lock_guard lock(will().mutex);
  will().socket = socket;
  tellExecutor(will().executor, {address, port}, socket);
}

void disarmLastWill(int socket) {
  const std::lock_guard lock(will().mutex);
  if (will().socket != socket) return;
  will().socket = -1;
  tellExecutor(will().executor, {}, -1);
}

}  // namespace tractiond::capture
