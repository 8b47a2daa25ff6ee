#include "daemon/app/prompt_solver.h"

#include "base/clock.h"
#include "daemon/solve/field_rules.h"

#include <algorithm>
#include <thread>
#include <utility>

namespace tractiond {
namespace {

using namespace std::chrono_literals;

/// What an interval between frames may be, where it is the patience.
constexpr std::chrono::nanoseconds kLeastPatience = 1ms, kMostPatience = 100ms;

}  // namespace

PromptSolver::PromptSolver(const PromptOptions& options, int markers, int nodes)
    : options_(options)
    , offers_({.solver = {}, .markers = blankMarkers(markers)})
    , solutions_(blankField(markers, nodes))
    , offer_{.solver = {}, .markers = blankMarkers(markers)}
    , solution_(blankField(markers, nodes))
    , taken_{.solver = {}, .markers = blankMarkers(markers)}
    , field_(blankField(markers, nodes)) {}

void PromptSolver::solve(const std::shared_ptr<solve::FieldSolver>& solver, const MarkerField& markers,
                         TractionField& field) {
  const auto patience = this->patience(markers.info);
  const bool isAnswered = solver->answer(markers, field);
  if (isAnswered && (field.method != Method::kContact || !solver->wantsModel())) return;
  offer_.solver = solver;
  offer_.markers = markers;
  offer_.isWaitedFor = !isAnswered;
  const std::uint64_t frame = markers.info.frameNumber;
  bool isOffered = false;
  const auto offer = [&] {
    // The other thread may be taking the one before, which takes some instructions, unless it is suspended meanwhile.
    if (isOffered || !(isOffered = offers_.put(offer_))) return;
    offer_.solver = nullptr;
    offered_.signal();
  };
  if (isAnswered) return offer();
  waitsFor_.store(frame, std::memory_order_relaxed);
  const std::int64_t end_ns = monotonicNow() + patience.count();
  for (;;) {
    offer();
    if (solutions_.swap(solution_) && solution_.markers.info.frameNumber == frame) {
      std::swap(field, solution_);
      break;
    }
    const std::chrono::nanoseconds left(end_ns - monotonicNow());
    if (left <= 0ns) {
      solve::clear(field);
      field.flags = markers.flags | kNotSolved;
      break;
    }
    solved_.wait(isOffered ? std::chrono::ceil<std::chrono::milliseconds>(left) : 1ms);
  }
  waitsFor_.store(0, std::memory_order_relaxed);
}

std::chrono::nanoseconds FrameInterval::next(const FrameInfo& frame) {
  const std::uint64_t frames = frame.frameNumber - std::exchange(number_, frame.frameNumber);
  const std::int64_t since_ns = frame.times.received_ns - std::exchange(received_ns_, frame.times.received_ns);
  return std::chrono::nanoseconds(since_ns / static_cast<std::int64_t>(std::max<std::uint64_t>(frames, 1)));
}

std::chrono::nanoseconds PromptSolver::patience(const FrameInfo& frame) {
  const auto interval = interval_.next(frame);
  if (options_.patience_ms > 0.0) {
    return std::chrono::nanoseconds(static_cast<std::int64_t>(1e6 * options_.patience_ms));
  }
  return std::clamp(interval, kLeastPatience, kMostPatience);
}

void PromptSolver::turn(std::chrono::milliseconds timeout) {
  if (!take()) {
    offered_.wait(timeout);
    if (!take()) return;
  }
  taken_.solver->solve(taken_.markers, field_);
  while (!solutions_.put(field_)) std::this_thread::yield();  // the other thread is taking one: some instructions
  solved_.signal();
  const std::uint64_t waitsFor = waitsFor_.load(std::memory_order_relaxed);
  const bool isAnotherWaiting = waitsFor != 0 && waitsFor != taken_.markers.info.frameNumber;  // it comes first
  if (!isAnotherWaiting) taken_.solver->learn();
  taken_.solver = nullptr;
}

/// Takes the newest frame that is offered, unless it is too early for another model. Nothing that was passed over, and
/// nothing that is done, keeps a solver: another zero's takes its place, and it is large.
bool PromptSolver::take() {
  if (!offers_.swap(taken_)) return false;
  if (taken_.isWaitedFor || options_.models_Hz <= 0.0) return true;
  const std::int64_t now_ns = monotonicNow();
  const bool isTooEarly = static_cast<double>(now_ns - made_ns_) * 1e-9 < 1.0 / options_.models_Hz;
  if (isTooEarly) {
    taken_.solver = nullptr;
  } else {
    made_ns_ = now_ns;
  }
  return !isTooEarly;
}

}  // namespace tractiond
