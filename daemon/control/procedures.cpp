#include "daemon/control/procedures.h"

#include <spdlog/spdlog.h>

namespace tractiond::control {
namespace {

/// Shortest time over which the rate is measured.
constexpr std::int64_t kRateOver_ns = 2'000'000'000;

}  // namespace

Procedures::Procedures(const ProcedureParts& parts, const ProcedureOptions& options)
    : parts_(parts)
    , options_(options)
    , steps_(parts, options)
    , zero_(parts, options, markers_, steps_) {
  parts_.markers.put(
      blankMarkers(parts.sensor.markerCount()));  // allocates the memory, so that the tracking thread does not have to
  parts_.markers.take(markers_);
}

void Procedures::restore(const std::string& camera, double rate_Hz, const std::optional<RestPose>& restored,
                         const std::optional<RestPose>& before) {
  camera_ = camera;
  if (rate_Hz_ == 0.0) rate_Hz_ = rate_Hz;
  zero_.setRate(rate_Hz_);
  if (restored) {
    spdlog::info("the zero is the one kept in {}", options_.directory.string());
  } else {
    spdlog::info("no zero is kept: the first {} still frames are taken for it", options_.zeroFrames);
  }
  zero_.restore(restored, before);
}

void Procedures::beginStep(const CalibrationStep& step) {
  using Kind = CalibrationStep::Kind;
  const bool restsOnTheZero = step.kind != Kind::kStiffness && step.kind != Kind::kFinish;
  if (restsOnTheZero) zero_.refuse("a step of a calibration was asked for before the zero was taken");
  framesForStep_ = {parts_.frames, options_.clock()};
  steps_.begin(step, zero_.inForce(), camera_);
}

void Procedures::turn() {
  measureRate();
  zero_.turn();
  watchMarkers();
  parts_.watched.put({markers_.drift, zero_.answeredWithin_s()});
}

void Procedures::watchMarkers() {
  if (parts_.markers.take(markers_)) {
    if (driftWarning_.take(parts_.sensor, markers_)) {
      const RestDrift& drift = markers_.drift;
      spdlog::warn("warning: the untouched picture has drifted from the zero by ({:.3f}, {:.3f}) px, scale {:.1e}, "
                   "roll {:.1e} rad; take a new zero with nothing touching the gel: tractionctl zero",
                   drift.shiftU_px, drift.shiftV_px, drift.scale, drift.roll);
    }
    steps_.add(markers_);
  }
  steps_.turn();
  if (steps_.isLooking() && framesForStep_.idle_ns(parts_.frames, options_.clock()) > ZeroProcedure::kNoFrames_ns) {
    steps_.drop(noFrames(zero_.waits()));
  }
}

void Procedures::measureRate() {
  const std::uint64_t frames = parts_.frames.get();
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

}  // namespace tractiond::control
