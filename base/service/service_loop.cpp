#include "base/service/service.h"
#include "base/service/systemd.h"

#include <algorithm>
#include <functional>
#include <string>
#include <utility>

namespace tractiond {
namespace {

using std::chrono::milliseconds;

/// Time between two checks whether a reload is done.
constexpr milliseconds kReloadCheck{20};
/// How often the status line changes: each time systemd tells whoever listens to it.
constexpr std::int64_t kStatus_ns = 1'000'000'000;

std::string reloading() {
  return "RELOADING=1\nMONOTONIC_USEC=" + std::to_string(monotonicNow() / 1000);
}

}  // namespace

ServiceRequests& serviceRequests() {
  static ServiceRequests requests;
  return requests;
}

LivenessCheck::LivenessCheck(const ServiceHooks& hooks)
    : hooks_(hooks)
    , seen_(hooks.loops.size()) {
  allAdvanced();
}

bool LivenessCheck::isAlive() {
  const bool others = !hooks_.others || hooks_.others();
  return allAdvanced() && others;
}

bool LivenessCheck::allAdvanced() {
  std::vector<std::uint64_t> now;
  for (const Counter* loop : hooks_.loops) now.push_back(loop->get());
  const bool all = std::ranges::equal(now, seen_, std::ranges::not_equal_to());
  if (all) seen_ = std::move(now);
  return all;
}

void ServiceLoop::Reload::begin() {
  systemd::notify(reloading());
  isUnderWay_ = true;
  if (!read_) return;
  reader_ = std::make_unique<BackgroundThread>("tr-reload");
  apply_ = reader_->start(read_);
}

void ServiceLoop::Reload::turn() {
  if (!isUnderWay_ || (reader_ && !reader_->awaitIdle(milliseconds(0)))) return;
  if (reader_) {
    reader_.reset();
    if (const std::function<void()> apply = apply_.get()) apply();
  }
  isUnderWay_ = false;
  systemd::notify("READY=1");
}

ServiceLoop::ServiceLoop(const ServiceHooks& hooks)
    : hooks_(hooks)
    , patience_(LivenessCheck::period(systemd::watchdog()))
    , liveness_(hooks)
    , reload_(hooks.reload)
    , told_ns_(hooks.monotonicClock()) {
  systemd::notify("READY=1\nSTATUS=" + hooks_.statusLine());
}

milliseconds ServiceLoop::patience() const {
  return isReloading() ? std::min(patience_, kReloadCheck) : patience_;
}

bool ServiceLoop::turn() {
  ServiceRequests& requests = serviceRequests();
  if (requests.stop.wait(milliseconds(0)) || hooks_.ended()) {
    systemd::notify("STOPPING=1");
    return false;
  }
  if (hooks_.startsAgain && hooks_.startsAgain()) {
    systemd::notify(reloading());
    return false;
  }
  reload_.turn();
  if (!isReloading() && requests.reload.wait(milliseconds(0))) reload_.begin();
  if (const std::int64_t now_ns = hooks_.monotonicClock(); now_ns - told_ns_ >= kStatus_ns) {
    told_ns_ = now_ns;
    systemd::notify("STATUS=" + hooks_.statusLine());
  }
  if (liveness_.isAlive()) systemd::notify("WATCHDOG=1");
  return true;
}

}  // namespace tractiond
