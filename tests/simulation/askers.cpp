#include "tests/simulation/askers.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace tractiond::simulation {

Askers::Askers(Zeros& zeros, const Starvation& starvation, Journal& journal)
    : zeros_(zeros)
    , starvation_(starvation)
    , journal_(journal) {}

bool Askers::noteZero(double within_s, const ZeroRequest& request) {
  const std::int64_t until_ns = within_s > 0.0 ? now() + static_cast<std::int64_t>(1e9 * within_s) + 500 * kMs : kNever;
  journal_.say(request.undo ? "asked: undo" : request.anyway ? "asked: zero, anyway" : "asked: zero");
  if (std::exchange(zeroAsked_, true)) {
    const bool shares = !request.undo && !request_.undo && request.anyway == request_.anyway;
    if (shares) zeroUntil_ns_ = std::min(zeroUntil_ns_, until_ns);
    return false;
  }
  request_ = request;
  zeros_.noteAsked(request.undo);
  askedWith_ = zeros_.inForce();
  expected_ = zeros_.previous();
  zeroUntil_ns_ = until_ns;
  zeroAskedStarved_ns_ = starvation_.total_ns();
  return true;
}

void Askers::noteZeroAnswer(const tl::expected<RestPose, std::string>& answer) {
  journal_.say("answer: " + (answer ? "zero " + nameOf(answer->id) : answer.error()));
  journal_.law(std::exchange(zeroAsked_, false), "each request gets one answer", "an answer to nobody");
  ++journal_.result.answers;
  if (!answer) return;
  journal_.law(zeros_.inForce() == answer->id, "the zero that is answered is in force", nameOf(answer->id));
  constexpr double kPress_N = 2.0;  // a weaker one may look like noise
  journal_.law(request_.undo || request_.anyway || !askedWith_ ||
                   zeros_.pressOf_N(answer->id) - zeros_.pressOf_N(*askedWith_) < kPress_N,
               "a zero is refused while something presses", fmt::format("{} N", zeros_.pressOf_N(answer->id)));
  if (request_.undo) {
    journal_.law(askedWith_ != answer->id, "an undo restores another zero", nameOf(answer->id));
    journal_.law(!expected_ || *expected_ == answer->id, "an undo restores the zero before",
                 fmt::format("{}, not {}", nameOf(answer->id), expected_ ? nameOf(*expected_) : ""));
    ++journal_.result.undone;
  } else {
    ++journal_.result.zerosTaken;
  }
}

void Askers::noteStep(const CalibrationStep& step, std::int64_t within_ns) {
  stepAsked_ = true;  // who asked before is answered by the control server
  stepUntil_ns_ = now() + within_ns;
  stepAskedStarved_ns_ = starvation_.total_ns();
  journal_.say(step.kind == CalibrationStep::Kind::kNoise
                   ? fmt::format("asked: noise over {:.0f} ms", 1e3 * step.seconds)
                   : "asked: the calibrated gel file");
}

void Askers::noteStepAnswer(const calibrate::Result& answer) {
  journal_.say("answer: " + (answer ? std::string("the step is done") : answer.error()));
  journal_.law(std::exchange(stepAsked_, false), "each request gets one answer",
               "an answer to a step that nobody asked for");
  ++journal_.result.answers;
}

void Askers::check() const {
  const std::int64_t starved_ns = starvation_.total_ns();
  const bool isWritten = zeros_.isIdle();  // else the disk may take any time
  journal_.law(!zeroAsked_ || !isWritten || zeroUntil_ns_ == kNever ||
                   now() <= zeroUntil_ns_ + starved_ns - zeroAskedStarved_ns_,
               "each request is answered in its time", "a zero or undo");
  journal_.law(!stepAsked_ || now() <= stepUntil_ns_ + starved_ns - stepAskedStarved_ns_,
               "each request is answered in its time", "a step of a calibration");
}

void Askers::die() {
  zeroAsked_ = false;
  stepAsked_ = false;
}

}  // namespace tractiond::simulation
