#include "base/service/service.h"

#include "base/clock.h"
#include "base/event.h"

#include <poll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <future>
#include <mutex>
#include <string>
#include <utility>

namespace tractiond {
namespace {

using std::chrono::milliseconds;

/// Between two looks whether a reload is done.
constexpr milliseconds kReloadLook{20};
/// How often the status line changes: each time systemd tells whoever listens to it.
constexpr std::int64_t kStatus_ns = 1'000'000'000;

constexpr std::array kSignals = {SIGTERM, SIGINT, SIGHUP};

struct Requests {
  Event stop, reload;
};

Requests& requests() {
  static Requests requests;
  return requests;
}

void onStopSignal(int) {
  const int before = errno;
  requests().stop.signal();
  errno = before;
}

void onReloadSignal(int) {
  const int before = errno;
  requests().reload.signal();
  errno = before;
}

void maskSignals(int how) {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : kSignals) sigaddset(&signals, signal);
  pthread_sigmask(how, &signals, nullptr);
}

/// Waits for a stop, and for a reload unless one is under way. \return whether to stop.
bool wait(milliseconds timeout, bool isReloading) {
  std::array<pollfd, 2> items{{{requests().stop.fd(), POLLIN, 0}, {requests().reload.fd(), POLLIN, 0}}};
  poll(items.data(), isReloading ? 1 : 2, static_cast<int>(timeout.count()));
  return requests().stop.wait(milliseconds(0));
}

/// Tells systemd, as sd_notify(3) does, but never waits: while systemd reads nothing, notices are dropped.
/// \return false: it was dropped
bool notify(const std::string& text) {
  const char* const path = std::getenv("NOTIFY_SOCKET");
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path == nullptr || (*path != '/' && *path != '@')) return true;  // nobody listens
  const std::size_t length = std::strlen(path);
  if (length >= sizeof address.sun_path) return true;
  std::memcpy(address.sun_path, path, length);
  if (*path == '@') address.sun_path[0] = '\0';  // abstract
  const int descriptor = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (descriptor < 0) return false;
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + length);
  const auto sent = sendto(descriptor, text.data(), text.size(), MSG_DONTWAIT | MSG_NOSIGNAL,
                           reinterpret_cast<const sockaddr*>(&address), size);
  close(descriptor);
  return sent >= 0;
}

/// Reloads on a thread of its own: a disk may take seconds to read a file, and the watchdog must be fed meanwhile.
class Reload {
 public:
  explicit Reload(const std::function<void()>& work)
      : work_(work) {}

  /// Starts a reload. Must not be called while one is under way.
  void begin() {
    notify("RELOADING=1\nMONOTONIC_USEC=" + std::to_string(monotonicNow() / 1000));
    done_ = std::async(std::launch::async, [this] {
      if (work_) work_();
    });
  }

  bool isUnderWay() {
    if (!done_.valid()) return false;
    if (done_.wait_for(milliseconds(0)) != std::future_status::ready) return true;
    if (notify("READY=1")) done_.get();
    return done_.valid();
  }

 private:
  const std::function<void()>& work_;
  std::future<void> done_;
};

}  // namespace

void catchSignals() {
  requests();  // made here, not in the handler
  const bool onTerminal = isatty(STDERR_FILENO) == 1;
  for (const int signal : kSignals) {
    struct sigaction action {};
    action.sa_handler = signal == SIGHUP && !onTerminal ? onReloadSignal : onStopSignal;
    action.sa_flags = SA_RESTART;
    sigaction(signal, &action, nullptr);
  }
  maskSignals(SIG_BLOCK);
}

StopWhileStarting::StopWhileStarting(std::function<void()> leave, milliseconds patience)
    : thread_([leave = std::move(leave), patience](const std::stop_token& started) {
      constexpr milliseconds kTurn{50};
      maskSignals(SIG_UNBLOCK);
      while (!requests().stop.wait(kTurn)) {
        if (started.stop_requested()) return;
      }
      requests().stop.signal();  // for run()
      std::mutex mutex;
      std::condition_variable_any changed;
      std::unique_lock lock(mutex);
      changed.wait_for(lock, started, patience, [] { return false; });
      if (!started.stop_requested()) leave();
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

tl::expected<void, Error> checkAddressSpace() {
  constexpr rlim_t kLeast_MiB = 2048;
  rlimit limit{};
  getrlimit(RLIMIT_AS, &limit);
  if (limit.rlim_cur == RLIM_INFINITY || limit.rlim_cur >> 20 >= kLeast_MiB) return {};
  return tl::unexpected(Error{.exitCode = EX_OSERR,
                              .what = std::to_string(limit.rlim_cur >> 20) + " MiB of address space are too few",
                              .remedy = "allow " + std::to_string(kLeast_MiB) +
                                        " MiB or more (LimitAS= of the service, ulimit -v); to bound what it really "
                                        "uses, MemoryMax="});
}

bool logsToJournal() {
  const char* const stream = std::getenv("JOURNAL_STREAM");  // device:inode
  struct stat own {};
  return stream != nullptr && fstat(STDERR_FILENO, &own) == 0 &&
         std::to_string(own.st_dev) + ":" + std::to_string(own.st_ino) == stream;
}

StageWatch::StageWatch(std::vector<const Counter*> loops)
    : loops_(std::move(loops))
    , seen_(loops_.size()) {
  allAdvanced();
}

bool StageWatch::allAdvanced() {
  std::vector<std::uint64_t> now;
  for (const Counter* loop : loops_) now.push_back(loop->get());
  const bool all = std::ranges::equal(now, seen_, std::ranges::not_equal_to());
  if (all) seen_ = std::move(now);
  return all;
}

void run(const ServiceHooks& hooks) {
  std::uint64_t deadline_us = 0;
  const bool watched = sd_watchdog_enabled(0, &deadline_us) > 0;
  const milliseconds look = LivenessCheck::period(std::chrono::microseconds(watched ? deadline_us : 0));
  LivenessCheck liveness(hooks);
  Reload reload(hooks.reload);
  std::int64_t told_ns = hooks.monotonicClock();
  const auto ready = [&] { return notify("READY=1\nSTATUS=" + hooks.statusLine()); };
  bool isReadyTold = ready();
  maskSignals(SIG_UNBLOCK);
  while (!wait(reload.isUnderWay() ? std::min(look, kReloadLook) : look, reload.isUnderWay()) && !hooks.ended()) {
    if (!reload.isUnderWay() && requests().reload.wait(milliseconds(0))) reload.begin();
    if (const std::int64_t now_ns = hooks.monotonicClock(); now_ns - told_ns >= kStatus_ns) {
      told_ns = now_ns;
      notify("STATUS=" + hooks.statusLine());
    }
    if (!isReadyTold) isReadyTold = ready();
    if (liveness.isAlive()) notify("WATCHDOG=1");
  }
  notify("STOPPING=1");
}

}  // namespace tractiond
