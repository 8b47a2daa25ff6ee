#include "daemon/procedures.h"

#include <spdlog/spdlog.h>

#include <utility>

namespace tractiond {
namespace {

/// A zero or a step of a calibration that was asked for fails when no frame comes for this long.
constexpr std::int64_t kNoFrames_ns = 5'000'000'000;

constexpr const char* kNoFrames = "no frames come from the camera";

}  // namespace

Procedures::Procedures(const sensor::Sensor& sensor, ProcedureOptions options, ProcedureLinks links)
    : sensor_(sensor)
    , options_(std::move(options))
    , links_(std::move(links))
    , driftWatch_(sensor)
    , calibration_(sensor, {.zeroFrames = options_.zeroFrames, .progress = options_.progress}) {
  MarkerField blank;
  blank.resize(sensor.markerCount());
  links_.markers.put(blank);  // the room, so that the tracking thread need not make it
  links_.markers.take(markers_);
}

void Procedures::welcome(const std::string& cameraId, const std::optional<RestPose>& restored) {
  camera_ = cameraId;
  zero_ = restored;
  if (!zero_) return;
  const std::string doubt = links_.judge(*zero_);
  if (!doubt.empty()) spdlog::warn("warning: the zero that was kept may be none: {}", doubt);
  links_.describe(*zero_);
}

void Procedures::beginZero() {
  zeroAsked_ = true;
  zeroPatience_ = patience();
  links_.requestZero();
}

void Procedures::beginStep(const CalibrationStep& step) {
  stepPatience_ = patience();
  if (const auto result = calibration_.begin(step, zero_ ? &*zero_ : nullptr, camera_, options_.directory)) {
    if (*result && !(*result)->path.empty()) spdlog::info("calibrated gel file written: {}", (*result)->path);
    links_.answerCalibration(*result);
  }
}

void Procedures::turn() {
  if (links_.takeRestPose(finished_)) keepZero();
  watchMarkers();
  if (zeroAsked_) watchZero();
}

void Procedures::keepZero() {
  if (calibration_.running()) {
    calibration_.drop();
    links_.answerCalibration(tl::unexpected<std::string>("a new zero was taken meanwhile"));
  }
  const std::string moved = zero_ ? calibrate::movedBetween(sensor_, *zero_, finished_) : "";
  const std::string doubt = links_.judge(finished_);
  zero_ = finished_;
  links_.describe(finished_);
  const auto kept = links_.keep(finished_);
  if (!kept) spdlog::error("the zero is in force but not kept: {}", kept.error().message());
  spdlog::info("zero taken, {}{}", finished_.requested ? "as requested" : "by itself at the first start",
               moved.empty() ? "" : "; " + moved);
  if (!doubt.empty()) spdlog::warn("warning: this may be no zero: {}", doubt);
  if (!finished_.requested) return;  // whoever asked meanwhile waits for the one he asked for
  if (kept) return answerZero(finished_, doubt);
  answerZero(tl::unexpected("the zero is in force but not kept: " + kept.error().message()));
}

void Procedures::watchZero() {
  const track::ZeroState state = links_.zeroState();
  if (state == track::ZeroState::kMoving || state == track::ZeroState::kTooFew) {
    return answerZero(tl::unexpected<std::string>(track::describe(state)));
  }
  if (noFrames(zeroPatience_)) answerZero(tl::unexpected<std::string>(kNoFrames));
}

void Procedures::answerZero(const tl::expected<RestPose, std::string>& result, const std::string& remark) {
  zeroAsked_ = false;
  links_.answerZero(result, remark);
}

void Procedures::watchMarkers() {
  if (links_.markers.take(markers_)) {
    driftWatch_.add(markers_);
    links_.drift.put(driftWatch_.drift());
    if (driftWatch_.takeWarning()) {
      const RestDrift& drift = driftWatch_.drift();
      spdlog::warn("warning: the untouched picture has drifted from the zero by ({:.3f}, {:.3f}) px, scale {:.1e}, "
                   "roll {:.1e} rad; take a new zero with nothing touching the gel: tractionctl zero",
                   drift.shiftU_px, drift.shiftV_px, drift.scale, drift.roll);
    }
    if (const auto result = calibration_.add(markers_)) links_.answerCalibration(*result);
  }
  if (calibration_.running() && noFrames(stepPatience_)) {
    calibration_.drop();
    links_.answerCalibration(tl::unexpected<std::string>(kNoFrames));
  }
}

Procedures::Patience Procedures::patience() const {
  return {links_.frames.get(), options_.clock()};
}

bool Procedures::noFrames(Patience& patience) const {
  const Patience now = this->patience();
  if (patience.frames != now.frames) patience = now;
  return now.last_ns - patience.last_ns > kNoFrames_ns;
}

}  // namespace tractiond
