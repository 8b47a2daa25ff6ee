#include "base/service/service.h"
#include "daemon/records/turns.h"
#include "tests/support/deadline.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <thread>

namespace tractiond::service_test {
namespace {

/// What systemd would see.
class NotifySocket {
 public:
  NotifySocket()
      : path_(std::filesystem::temp_directory_path() / ("notify-" + std::to_string(getpid()))) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path_.native().copy(address.sun_path, sizeof address.sun_path - 1);
    const timeval patience{test::kHung.count(), 0};
    setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    EXPECT_EQ(bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    setenv("NOTIFY_SOCKET", path_.c_str(), 1);
    setenv("WATCHDOG_USEC", "40000", 1);
    setenv("WATCHDOG_PID", std::to_string(getpid()).c_str(), 1);
  }
  ~NotifySocket() {
    unsetenv("NOTIFY_SOCKET");
    unsetenv("WATCHDOG_USEC");
    unsetenv("WATCHDOG_PID");
    close(socket_);
    std::filesystem::remove(path_);
  }

  /// Waits for the next message. Ends the program if none comes: the service hangs, and cannot be joined.
  std::string next() {
    std::array<char, 4096> text{};
    const auto size = recv(socket_, text.data(), text.size(), 0);
    if (size < 0) std::fputs("the service has told systemd nothing for two minutes\n", stderr), std::abort();
    return {text.data(), static_cast<std::size_t>(size)};
  }
  /// Waits for a message of exactly these words, as the service tells others every few milliseconds.
  void skipTo(const std::string& wanted) {
    const auto until = std::chrono::steady_clock::now() + test::kHung;
    while (next() != wanted) {
      if (std::chrono::steady_clock::now() < until) continue;
      std::fprintf(stderr, "the service has never told systemd %s\n", wanted.c_str());
      std::abort();
    }
  }

 private:
  std::filesystem::path path_;
  int socket_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
};

/// Turns, and a clock, that advance with every turn of the service. What hangs is the simulation's.
struct Fixture {
  void advance() {
    now_ns += step_ns;
    for (Counter* stage : {&turns.capture, &turns.track, &turns.solve, &turns.publish, &turns.control}) stage->add();
  }
  ServiceHooks hooks() {
    return {loopsOf(turns),
            [this] { return advance(), ended.load(); },
            [] { return std::string("well"); },
            {},
            {},
            [] { return now_ns.load(); }};
  }

  static inline std::atomic<std::int64_t> now_ns{0};

  Turns turns;
  std::atomic<bool> ended{false};
  std::atomic<std::int64_t> step_ns{300'000'000};
};

TEST(Service, ThatStartsAgainIsReloadedAndNotStopped) {
  NotifySocket systemd;
  Fixture fixture;
  std::atomic<bool> again{false};
  ServiceHooks hooks = fixture.hooks();
  hooks.startsAgain = [&] { return again.load(); };
  std::thread service([&] { run(hooks); });
  systemd.skipTo("WATCHDOG=1");
  again = true;
  std::string notice;
  do notice = systemd.next();
  while (!notice.starts_with("RELOADING=1\nMONOTONIC_USEC=") && notice != "STOPPING=1");
  EXPECT_NE(notice, "STOPPING=1");
  service.join();
}

TEST(Service, IsFedWhileItStarts) {
  NotifySocket systemd;
  const StopWhileStarting starting([] {});
  systemd.skipTo("WATCHDOG=1");
}

TEST(Service, TellsItsStatusOnceASecond) {
  NotifySocket systemd;
  Fixture fixture;
  fixture.step_ns = 250'000'000;
  std::thread service([&] { run(fixture.hooks()); });
  EXPECT_EQ(systemd.next(), "READY=1\nSTATUS=well");
  for (int second = 0; second < 3; ++second) {
    for (int turn = 1; turn < 4; ++turn) EXPECT_EQ(systemd.next(), "WATCHDOG=1");
    EXPECT_EQ(systemd.next(), "STATUS=well");
    EXPECT_EQ(systemd.next(), "WATCHDOG=1");
  }
  fixture.ended = true;
  systemd.skipTo("STOPPING=1");
  service.join();
}

TEST(Service, ReturnsOnASignalWhicheverThreadTakesIt) {
  for (const int signal : {SIGTERM, SIGINT}) {
    Fixture fixture;
    NotifySocket systemd;
    pid_t thread = 0;
    std::thread service([&] {
      catchSignals();
      thread = gettid();
      run(fixture.hooks());
    });
    systemd.skipTo("WATCHDOG=1");
    if (signal == SIGTERM) {
      kill(getpid(), signal);  // this thread has not blocked it: as threads that were there before main()
    } else {
      tgkill(getpid(), thread, signal);
    }
    systemd.skipTo("STOPPING=1");
    service.join();
  }
}

TEST(Service, ReloadsOnAHangupAndIsReadyAgain) {
  NotifySocket systemd;
  Fixture fixture;
  std::atomic<int> reads{0}, reloads{0};
  std::thread service([&] {
    catchSignals();
    ServiceHooks hooks = fixture.hooks();
    hooks.reload = [&]() -> std::function<void()> {
      ++reads;
      return [&, reader = std::this_thread::get_id()] {
        EXPECT_NE(std::this_thread::get_id(), reader);
        ++reloads;
      };
    };
    run(hooks);
  });
  systemd.skipTo("WATCHDOG=1");
  for (int i = 1; i <= 3; ++i) {
    kill(getpid(), SIGHUP);
    while (!systemd.next().starts_with("RELOADING=1\nMONOTONIC_USEC=")) {
    }
    systemd.skipTo("READY=1");
    EXPECT_EQ(reads, i);
    EXPECT_EQ(reloads, i);
  }
  systemd.skipTo("WATCHDOG=1");
  fixture.ended = true;
  service.join();
}

}  // namespace
}  // namespace tractiond::service_test
