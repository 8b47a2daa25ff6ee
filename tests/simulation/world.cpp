#include "tests/simulation/world.h"

#include "base/background_thread.h"
#include "base/clock.h"
#include "base/event.h"
#include "tests/simulation/disk.h"
#include "tests/simulation/fiber.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace tractiond {

std::int64_t clockNow(clockid_t clock) {
  const simulation::Clocks& now = simulation::clocks();
  return now.monotonic_ns + now.hurried_ns + (clock == CLOCK_REALTIME ? now.realAhead_ns : 0);
}

namespace {

constexpr int kCalm = -1, kSignalled = -2;  // in the place of the descriptor

/// When background threads become idle.
std::vector<std::int64_t>& idleTimes() {
  static std::vector<std::int64_t> times;
  return times;
}

}  // namespace

Event::Event()
    : fd_(kCalm) {}

Event::~Event() = default;

void Event::signal() noexcept {
  fd_ = kSignalled;
}

bool Event::wait(std::chrono::milliseconds timeout) noexcept {
  const std::int64_t until_ns = monotonicNow() + std::chrono::nanoseconds(timeout).count();
  if (timeout.count() > 0) simulation::Fiber::wait(until_ns, [this] { return fd_ == kSignalled; });
  return std::exchange(fd_, kCalm) == kSignalled;
}

void Event::clear() noexcept {
  fd_ = kCalm;
}

struct BackgroundThread::State {
  std::int64_t idle_ns = 0;  ///< when it is idle
};

BackgroundThread::BackgroundThread(const char* /*name*/, std::shared_ptr<Event> /*idle*/)
    : state_(std::make_shared<State>()) {}

BackgroundThread::~BackgroundThread() = default;

void BackgroundThread::run(std::function<void()> work) {
  std::int64_t& spent_ns = simulation::spent_ns();
  const std::int64_t callers_ns = std::exchange(spent_ns, 0);
  state_->idle_ns = std::max(state_->idle_ns, simulation::now() + callers_ns);
  simulation::Disk* const disk = simulation::disk();
  if (disk != nullptr) disk->beginWork(state_->idle_ns);
  work();
  if (disk != nullptr) state_->idle_ns = disk->endWork();
  state_->idle_ns += std::exchange(spent_ns, callers_ns);
  idleTimes().push_back(state_->idle_ns);
}

bool BackgroundThread::awaitIdle(std::chrono::milliseconds patience) const {
  std::int64_t& spent_ns = simulation::spent_ns();
  const std::int64_t left_ns = state_->idle_ns - simulation::now() - spent_ns;
  const std::int64_t patience_ns = std::chrono::nanoseconds(patience).count();
  spent_ns += std::clamp<std::int64_t>(left_ns, 0, patience_ns);
  return left_ns <= patience_ns;
}

namespace simulation {

Clocks& clocks() {
  static Clocks now;
  return now;
}

std::int64_t& spent_ns() {
  static std::int64_t spent = 0;
  return spent;
}

std::int64_t nextIdle_ns() {
  std::erase_if(idleTimes(), [](std::int64_t at_ns) { return at_ns <= now(); });
  return idleTimes().empty() ? kNever : *std::ranges::min_element(idleTimes());
}

void forgetBackground() {
  idleTimes().clear();
}

}  // namespace simulation
}  // namespace tractiond
