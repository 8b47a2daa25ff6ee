#include "daemon/control/procedures.h"

#include <spdlog/spdlog.h>

#include <utility>

namespace tractiond {
namespace {

/// Shortest time over which the rate is measured.
constexpr std::int64_t kRateOver_ns = 2'000'000'000;

}  // namespace

Procedures::Procedures(const sensor::Sensor& sensor, ProcedureOptions options, ProcedureLinks links)
    : options_(std::move(options))
    , links_(std::move(links))
    , driftWatch_(sensor)
    , steps_(sensor, {.zeroFrames = options_.zeroFrames},
             {.start = links_.startWork,
              .answer = [this](const auto& result) { answerStep(result); },
              .clock = options_.clock})
    , zero_(sensor, options_.zeroFrames, options_.clock, links_.frames, links_.zero, [this] { dropStep(); }) {
  MarkerField blank;
  blank.resize(sensor.markerCount());
  links_.markers.put(blank);  // allocates the memory, so that the tracking thread does not have to
  links_.markers.take(markers_);
}

void Procedures::welcome(const std::string& cameraId, double rate_Hz, const std::optional<RestPose>& restored,
                         const std::optional<RestPose>& before, bool isWritten) {
  camera_ = cameraId;
  if (rate_Hz_ == 0.0) rate_Hz_ = rate_Hz;
  zero_.setRate(rate_Hz_);
  if (restored) {
    spdlog::info("the zero is the one kept in {}", options_.directory.string());
  } else {
    spdlog::info("no zero is kept: the first {} still frames are taken for it", options_.zeroFrames);
  }
  zero_.welcome(restored, before, isWritten);
}

void Procedures::setWaits(const std::string& waits) {
  waits_ = waits;
  zero_.setWaits(waits);
}

void Procedures::beginStep(const CalibrationStep& step) {
  using Kind = CalibrationStep::Kind;
  const bool restsOnTheZero = step.kind != Kind::kStiffness && step.kind != Kind::kFinish;
  if (restsOnTheZero) zero_.refuse("a step of a calibration was asked for before the zero was taken");
  framesForStep_ = {links_.frames, options_.clock()};
  steps_.begin(step, zero_.inForce(), camera_, options_.directory);
}

void Procedures::turn() {
  measureRate();
  zero_.turn();
  watchMarkers();
  links_.watched.put({driftWatch_.drift(), zero_.answeredWithin_s()});
}

void Procedures::dropStep() {
  steps_.drop("a new zero was taken meanwhile");
}

void Procedures::answerStep(const calibrate::Result& result) {
  if (result && !result->path.empty()) spdlog::info("calibrated gel file written: {}", result->path);
  links_.answerCalibration(result);
}

void Procedures::watchMarkers() {
  if (links_.markers.take(markers_)) {
    driftWatch_.add(markers_);
    if (driftWatch_.takeWarning()) {
      const RestDrift& drift = driftWatch_.drift();
      spdlog::warn("warning: the untouched picture has drifted from the zero by ({:.3f}, {:.3f}) px, scale {:.1e}, "
                   "roll {:.1e} rad; take a new zero with nothing touching the gel: tractionctl zero",
                   drift.shiftU_px, drift.shiftV_px, drift.scale, drift.roll);
    }
    steps_.add(markers_);
  }
  steps_.turn();
  if (steps_.isLooking() &&
      framesForStep_.idle_ns(links_.frames, options_.clock()) > zero::ZeroProcedure::kNoFrames_ns) {
    steps_.drop(zero::noFrames(waits_));
  }
}

void Procedures::measureRate() {
  const std::uint64_t frames = links_.frames.get();
  const std::int64_t now_ns = options_.clock();
  if (then_ns_ == 0) {
    then_ns_ = now_ns;
    framesThen_ = frames;
  }
  if (frames == framesThen_ || now_ns - then_ns_ < kRateOver_ns) return;
  rate_Hz_ = static_cast<double>(frames - framesThen_) * 1e9 / static_cast<double>(now_ns - then_ns_);
  zero_.setRate(rate_Hz_);
  then_ns_ = now_ns;
  framesThen_ = frames;
}

}  // namespace tractiond
