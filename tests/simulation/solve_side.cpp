#include "tests/simulation/solve_side.h"

#include "base/clock.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace tractiond::simulation {
namespace {

constexpr std::int64_t kUsual_ns = 3 * kMs;  ///< longest time of a solution, and of a model

}  // namespace

SolveSide::SolveSide(const Gel& gel, const PromptOptions& options, Modelling& modelling, const Starvation& starvation,
                     const Ongoing& ongoing, Journal& journal)
    : options_(options)
    , modelling_(modelling)
    , starvation_(starvation)
    , ongoing_(ongoing)
    , journal_(journal)
    , judge_(gel)
    , solver_(std::make_shared<LearningSolver>(gel, [this] { work(); }))
    , prompt_(options, gel.sensor.markerCount(), gel.sensor.nodes.count())
    , modelThread_([this] { prompt_.turn(std::chrono::milliseconds(100)); }) {
  expected_.resize(gel.sensor.markerCount(), gel.sensor.nodes.count());
}

void SolveSide::work() {
  const bool isSlow = ongoing_.lasts(Event::kSlowModels);
  const std::int64_t longest_ns = isSlow ? ongoing_.amountOf(Event::kSlowModels) * kMs : kUsual_ns;
  Fiber::sleep(modelling_.chance.between(longest_ns / 4, longest_ns));
}

void SolveSide::stop() {
  hasStopped_ = true;
  modelThread_.end();
}

void SolveSide::solve(const MarkerField& markers, TractionField& field) {
  const std::int64_t began_ns = now(), daemonBegan_ns = monotonicNow(), patience_ns = this->patience_ns(markers.info);
  prompt_.solve(solver_, markers, field);
  const std::int64_t lasted_ns = monotonicNow() - daemonBegan_ns;
  if (lasted_ns > 0) waited_ns_ = now();
  checkWait(field, patience_ns, lasted_ns - starvation_.since(began_ns));
  checkNumbers(markers, field);
}

/// Returns what a frame may wait: as set, or the interval to the frame before.
std::int64_t SolveSide::patience_ns(const FrameInfo& info) {
  const std::int64_t interval_ns = info.times.received_ns - std::exchange(last_ns_, info.times.received_ns);
  if (options_.patience_ms > 0.0) return static_cast<std::int64_t>(1e6 * options_.patience_ms);
  return std::clamp(interval_ns, kMs, 100 * kMs);
}

void SolveSide::checkWait(const TractionField& field, std::int64_t patience_ns, std::int64_t lasted_ns) const {
  constexpr std::int64_t kLately_ns = kSecond, kPieces = 3;  // an earlier frame and its model, and this frame
  journal_.law(lasted_ns <= patience_ns + kMs, "no frame waits for its solution longer than its patience",
               [&] { return fmt::format("{} us of {}", lasted_ns / 1000, patience_ns / 1000); });
  const bool isFast = kPieces * kUsual_ns <= patience_ns && !hasStopped_ &&
                      ongoing_.until_ns(Event::kSlowModels) < now() - kLately_ns &&
                      modelling_.starvation.since(now() - kLately_ns) == 0;
  journal_.law((field.flags & kNotSolved) == 0 || !isFast, "a thread that is fast enough solves what no model answers",
               [&] { return fmt::format("frame {} after {} us", field.markers.info.frameNumber, lasted_ns / 1000); });
}

void SolveSide::checkNumbers(const MarkerField& markers, const TractionField& field) {
  const MarkerField& of = field.markers;
  const bool isOwn = of.info.frameNumber == markers.info.frameNumber && of.zero == markers.zero &&
                     of.displacement_px == markers.displacement_px && of.valid == markers.valid;
  journal_.law(isOwn, "a frame that enters solving leaves it once, in its order", [&] {
    return fmt::format("frame {} of zero {}, not {} of {}", of.info.frameNumber, nameOf(of.zero),
                       markers.info.frameNumber, nameOf(markers.zero));
  });
  judge_.solve(markers, expected_);
  const bool isNotSolved = (field.flags & kNotSolved) != 0;
  journal_.law(!isNotSolved || expected_.method == Method::kContact, "only a contact may be left not solved", "");
  if (isNotSolved) {
    solve::clear(expected_);
    expected_.flags = markers.flags | kNotSolved;
  }
  const bool isRight = field.valid == expected_.valid && field.flags == expected_.flags &&
                       field.method == expected_.method && field.resultant_N == expected_.resultant_N;
  journal_.law(isRight, "a field has its own frame's forces, or none", [&] {
    return fmt::format("frame {}: valid {}, not {}; flags {:x}, not {:x}; {} N, not {} N", of.info.frameNumber,
                       field.valid, expected_.valid, field.flags, expected_.flags, field.resultant_N[2],
                       expected_.resultant_N[2]);
  });
}

}  // namespace tractiond::simulation
