#include "daemon/capture/last_will.h"

#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <atomic>
#include <csignal>
#include <mutex>

namespace tractiond::capture {
namespace {

constexpr std::array kSignals{SIGABRT, SIGBUS, SIGFPE, SIGILL, SIGSEGV};
/// GigE Vision's control protocol: write 0 to the control channel privilege register.
constexpr std::array<std::uint8_t, 16> kRelease{0x42, 0x01, 0x00, 0x82, 0, 8, 0xff, 0xff, 0, 0, 0x0a, 0x00, 0, 0, 0, 0};

struct Will {
  std::mutex mutex;  ///< of who writes it
  std::atomic<int> socket{-1};
  std::atomic<std::uint64_t> camera{0};  ///< address and port
  std::array<struct sigaction, kSignals.size()> before{};
};

Will& will() {
  static Will one;  // made when it is armed, not in the handler
  return one;
}

/// Calls only what a signal's handler may (signal-safety(7)).
void execute(int signal, siginfo_t* info, void* /*context*/) {
  const std::uint64_t camera = will().camera;
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_addr.s_addr = htonl(static_cast<std::uint32_t>(camera >> 16));
  to.sin_port = htons(static_cast<std::uint16_t>(camera));
  const int socket = will().socket.exchange(-1);
  if (socket >= 0)
    sendto(socket, kRelease.data(), kRelease.size(), MSG_DONTWAIT, reinterpret_cast<const sockaddr*>(&to), sizeof to);
  for (std::size_t i = 0; i < kSignals.size(); ++i) sigaction(kSignals[i], &will().before[i], nullptr);
  // An instruction that failed fails again; what somebody sent has to be sent again.
  if (info->si_code <= 0) raise(signal);
}

}  // namespace

void armLastWill(int socket, std::uint32_t address, std::uint16_t port) {
  const std::lock_guard lock(will().mutex);
  static std::once_flag once;
  std::call_once(once, [] {
    struct sigaction action {};
    action.sa_sigaction = execute;
    action.sa_flags = SA_SIGINFO;
    for (std::size_t i = 0; i < kSignals.size(); ++i) sigaction(kSignals[i], &action, &will().before[i]);
  });
  will().socket = -1;
  will().camera = std::uint64_t{address} << 16 | port;
  will().socket = socket;
}

void disarmLastWill(int socket) {
  const std::lock_guard lock(will().mutex);
  if (will().socket == socket) will().socket = -1;
}

}  // namespace tractiond::capture
