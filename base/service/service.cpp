#include "base/service/service.h"

#include "base/service/systemd.h"

#include <poll.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <string>
#include <utility>

namespace tractiond {
namespace {

using std::chrono::milliseconds;

constexpr std::array kSignals = {SIGTERM, SIGINT, SIGHUP};

template <Event ServiceRequests::*kRequest>
void onSignal(int) {
  const int before = errno;
  (serviceRequests().*kRequest).signal();
  errno = before;
}

void maskSignals(int how) {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : kSignals) sigaddset(&signals, signal);
  pthread_sigmask(how, &signals, nullptr);
}

/// Waits for a stop, and for a reload unless one is under way.
void wait(milliseconds timeout, bool isReloading) {
  ServiceRequests& requests = serviceRequests();
  std::array<pollfd, 2> items{{{requests.stop.fd(), POLLIN, 0}, {requests.reload.fd(), POLLIN, 0}}};
  poll(items.data(), isReloading ? 1 : 2, static_cast<int>(timeout.count()));
}

}  // namespace

void catchSignals() {
  serviceRequests();  // made here, not in the handler
  const bool onTerminal = isatty(STDERR_FILENO) == 1;
  for (const int signal : kSignals) {
    struct sigaction action {};
    action.sa_handler = signal == SIGHUP && !onTerminal ? onSignal<&ServiceRequests::reload> : onSignal<&ServiceRequests::stop>;
    action.sa_flags = SA_RESTART;
    sigaction(signal, &action, nullptr);
  }
  maskSignals(SIG_BLOCK);
}

void admitSignals() {
  maskSignals(SIG_UNBLOCK);
}

StopWhileStarting::StopWhileStarting(std::function<void()> leave)
    : thread_([leave = std::move(leave)](const std::stop_token& started) {
      constexpr milliseconds kTurn{50};
      maskSignals(SIG_UNBLOCK);
      const milliseconds feeding = feedingPeriod();
      milliseconds unfed{0};
      while (!serviceRequests().stop.wait(kTurn)) {
        if (started.stop_requested()) return;
        if ((unfed += kTurn) < feeding) continue;
        unfed = {};
        systemd::notify("WATCHDOG=1");
      }
      leave();
    }) {}

tl::expected<void, Error> raiseDescriptorLimit() {
  constexpr rlim_t kFewest = 256;
  rlimit limit{};
  getrlimit(RLIMIT_NOFILE, &limit);
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);
  if (limit.rlim_max >= kFewest) return {};
  return tl::unexpected(Error{.exitCode = EX_OSERR,
                              .what = std::to_string(limit.rlim_max) + " file descriptors are too few: each subscriber "
                                                                       "takes one",
                              .remedy = "allow 65536 (LimitNOFILE= of the service, ulimit -n)"});
}

bool logsToJournal() {
  const char* const stream = std::getenv("JOURNAL_STREAM");  // device:inode
  struct stat own {};
  return stream != nullptr && fstat(STDERR_FILENO, &own) == 0 &&
         std::to_string(own.st_dev) + ":" + std::to_string(own.st_ino) == stream;
}

void run(const ServiceHooks& hooks) {
  ServiceLoop loop(hooks);
  admitSignals();
  do wait(loop.patience(), loop.isReloading());
  while (loop.turn());
}

}  // namespace tractiond
