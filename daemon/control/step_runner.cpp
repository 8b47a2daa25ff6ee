#include "daemon/control/step_runner.h"

#include <chrono>
#include <utility>

namespace tractiond::calibrate {

StepRunner::StepRunner(const sensor::Sensor& inForce, const CalibrationOptions& options, StepLinks links)
    : links_(std::move(links))
    , calibration_(inForce, options) {}

void StepRunner::begin(const CalibrationStep& step, const std::optional<RestPose>& zero, const std::string& camera,
                       const std::filesystem::path& directory) {
  Begin begin{step, zero, camera, directory};
  if (!work_) return start(std::move(begin));
  work_->isAwaited = false;
  waiting_ = std::move(begin);
}

void StepRunner::start(Begin begin) {
  run([this, begin = std::move(begin)] {
    return calibration_.begin(begin.step, begin.zero ? &*begin.zero : nullptr, begin.camera, begin.directory);
  });
}

void StepRunner::run(StepLinks::Work work) {
  work_ = {.done = links_.start(std::move(work)), .until_ns = links_.clock() + kWorkWithin_ns};
  turn();
}

void StepRunner::drop(const std::string& reason) {
  if (waiting_) {
    waiting_.reset();
    links_.answer(tl::unexpected(reason));
  } else if (work_) {
    work_->dropReason = reason;
  } else if (calibration_.running()) {
    calibration_.drop();
    links_.answer(tl::unexpected(reason));
  }
}

void StepRunner::add(const MarkerField& field) {
  if (!isLooking()) return;
  if (calibration_.nextTakesLong()) return run([this, field] { return calibration_.add(field); });
  if (const auto result = calibration_.add(field)) links_.answer(*result);
}

void StepRunner::turn() {
  if (!work_) return;
  if (work_->done.wait_for(std::chrono::seconds(0)) == std::future_status::ready) return heedEnd();
  if (links_.clock() <= work_->until_ns || !(work_->isAwaited || waiting_)) return;
  work_->isAwaited = false;
  waiting_.reset();
  links_.answer(tl::unexpected<std::string>("a step of a calibration has not ended within four minutes"));
}

/// Handles the end of background work: answers its request, or gives frames to its step; begins the step that waits.
void StepRunner::heedEnd() {
  UnderWay ended = *std::exchange(work_, std::nullopt);
  const std::optional<Result> result = ended.done.get();
  if (!ended.isAwaited) {
    calibration_.drop();
  } else if (result) {
    links_.answer(*result);
  } else if (!ended.dropReason.empty()) {
    drop(ended.dropReason);
  }
  if (waiting_) start(*std::exchange(waiting_, std::nullopt));
}

}  // namespace tractiond::calibrate
