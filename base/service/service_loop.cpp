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

milliseconds feedingPeriod() {
  constexpr milliseconds kLongest{1000};
  const auto quarter = std::chrono::duration_cast<milliseconds>(systemd::watchdog() / 4);
  return quarter.count() == 0 ? kLongest : std::min(kLongest, quarter);
}

ServiceLoop::ServiceLoop(const ServiceHooks& hooks)
    : hooks_(hooks)
    , patience_(feedingPeriod())
    , seen_(hooks.loops.size())
    , reported_ns_(hooks.monotonicClock()) {
  haveAllAdvanced();
  systemd::notify("READY=1\nSTATUS=" + hooks_.statusLine());
}

bool ServiceLoop::haveAllAdvanced() {
  std::vector<std::uint64_t> now;
  for (const Counter* loop : hooks_.loops) now.push_back(loop->get());
  const bool all = std::ranges::equal(now, seen_, std::ranges::not_equal_to());
  if (all) seen_ = std::move(now);
  return all;
}

void ServiceLoop::beginReload() {
  systemd::notify(reloading());
  reader_ = std::make_unique<BackgroundThread>("tr-reload");
  apply_ = reader_->start([read = hooks_.reload] { return read ? read() : nullptr; });
}

/// Applies what the reload has read, when it has.
void ServiceLoop::endReload() {
  if (!reader_ || !reader_->awaitIdle(milliseconds(0))) return;
  reader_.reset();
  if (const std::function<void()> apply = apply_.get()) apply();
  systemd::notify("READY=1");
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
  endReload();
  if (!isReloading() && requests.reload.wait(milliseconds(0))) beginReload();
  if (const std::int64_t now_ns = hooks_.monotonicClock(); now_ns - reported_ns_ >= kStatus_ns) {
    reported_ns_ = now_ns;
    systemd::notify("STATUS=" + hooks_.statusLine());
  }
  const bool areOthersAlive = !hooks_.others || hooks_.others();
  if (haveAllAdvanced() && areOthersAlive) systemd::notify("WATCHDOG=1");
  return true;
}

}  // namespace tractiond
