#include "daemon/service.h"

#include <systemd/sd-daemon.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <ctime>

namespace tractiond {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

/// Between two looks at the pipeline when there is no watchdog; also how often the status line changes.
constexpr milliseconds kLook{1000};

sigset_t stopSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  return signals;
}

bool stopRequested(microseconds wait) {
  const sigset_t signals = stopSignals();
  const timespec time{wait.count() / 1'000'000, wait.count() % 1'000'000 * 1000};
  return sigtimedwait(&signals, nullptr, &time) > 0;
}

}  // namespace

void blockSignals() {
  const sigset_t signals = stopSignals();
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
}

StageWatch::StageWatch(const Turns& turns)
    : stages_{&turns.capture, &turns.track, &turns.solve, &turns.publish, &turns.control} {
  allAdvanced();
}

bool StageWatch::allAdvanced() {
  std::array<std::uint64_t, 5> now{};
  bool all = true;
  for (std::size_t i = 0; i < stages_.size(); ++i) {
    now[i] = stages_[i]->get();
    all = all && now[i] != seen_[i];
  }
  if (all) seen_ = now;
  return all;
}

void run(const ServiceHooks& hooks) {
  std::uint64_t deadline_us = 0;
  const bool watched = sd_watchdog_enabled(0, &deadline_us) > 0;
  // Asked four times within the watchdog's patience: a stage may take half of it for one turn.
  const microseconds look = watched ? std::min<microseconds>(kLook, microseconds(deadline_us / 4)) : kLook;
  StageWatch watch(hooks.turns);
  sd_notify(0, ("READY=1\nSTATUS=" + hooks.statusLine()).c_str());
  while (!stopRequested(look) && !hooks.ended()) {
    sd_notify(0, ("STATUS=" + hooks.statusLine()).c_str());
    if (watch.allAdvanced()) sd_notify(0, "WATCHDOG=1");
  }
  sd_notify(0, "STOPPING=1");
}

}  // namespace tractiond
