#include "daemon/control/step_runner.h"

#include <spdlog/spdlog.h>

#include <chrono>
#include <utility>

namespace tractiond::control {

StepRunner::StepRunner(const ProcedureParts& parts, const ProcedureOptions& options)
    : parts_(parts)
    , options_(options)
    , calibration_(parts.sensor, options.zeroFrames) {}

void StepRunner::begin(const CalibrationStep& step, const std::optional<RestPose>& zero, const std::string& camera) {
  Begin begin{step, zero, camera};
  if (!work_) return start(std::move(begin));
  work_->isAwaited = false;
  waiting_ = std::move(begin);
}

void StepRunner::start(Begin begin) {
  run([this, begin = std::move(begin)] {
    return calibration_.begin(begin.step, begin.zero ? &*begin.zero : nullptr, begin.camera, options_.directory);
  });
}

void StepRunner::run(StepWork work) {
  work_ = {.done = parts_.host.start(std::move(work))};
  turn();
}

void StepRunner::drop(const std::string& reason) {
  if (waiting_) {
    waiting_.reset();
    answer(tl::unexpected(reason));
  } else if (work_) {
    work_->dropReason = reason;
  } else if (calibration_.running()) {
    calibration_.drop();
    answer(tl::unexpected(reason));
  }
}

void StepRunner::add(const MarkerField& field) {
  if (work_) return;
  if (calibration_.nextTakesLong()) return run([this, field] { return calibration_.add(field); });
  if (const auto result = calibration_.add(field)) answer(*result);
}

void StepRunner::turn() {
  if (!work_ || work_->done.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
  UnderWay ended = *std::exchange(work_, std::nullopt);
  const std::optional<calibrate::Result> result = ended.done.get();
  if (!ended.isAwaited) {
    calibration_.drop();
  } else if (result) {
    answer(*result);
  } else if (!ended.dropReason.empty()) {
    drop(ended.dropReason);
  }
  if (waiting_) start(*std::exchange(waiting_, std::nullopt));
}

void StepRunner::answer(const calibrate::Result& result) {
  if (result && !result->path.empty()) spdlog::info("calibrated gel file written: {}", result->path);
  parts_.replies.answerCalibration(result);
}

}  // namespace tractiond::control
