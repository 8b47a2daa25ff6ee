#include "daemon/procedures.h"

#include "daemon/calibrate/zero_check.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

namespace tractiond {
namespace {

constexpr const char* kNoFrames = "no frames come from the camera";

/// The rate is measured over at least this long.
constexpr std::int64_t kRateOver_ns = 2'000'000'000;

/// Of the frames that a zero may take: as many again may be torn, one may be under way.
constexpr int kZeroFrames = 2, kUnderWay = 2;

/// Two sentences, either of which may be empty.
std::string both(const std::string& one, const std::string& other) {
  return one + (one.empty() || other.empty() ? "" : "; ") + other;
}

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

void Procedures::welcome(const std::string& cameraId, double rate_Hz, const std::optional<RestPose>& restored,
                         const std::optional<RestPose>& before) {
  camera_ = cameraId;
  if (rate_Hz_ == 0.0) rate_Hz_ = rate_Hz;
  zero_ = restored;
  before_ = before;
  if (!zero_) return;
  const std::string doubt = both(links_.judge(*zero_), calibrate::touchIn(sensor_, *zero_));
  if (!doubt.empty()) spdlog::warn("warning: the zero that was kept may be none: {}", doubt);
  links_.describe(*zero_);
}

void Procedures::beginZero(const ZeroRequest& request) {
  zeroAsked_ = true;
  request_ = request;
  if (request.undo) return undoZero();
  lastForZero_ = seen();
  zeroUntil_ns_ = lastForZero_.at_ns + static_cast<std::int64_t>(1e9 * zeroWithin_s());
  links_.requestZero();
}

void Procedures::beginStep(const CalibrationStep& step) {
  using Kind = CalibrationStep::Kind;
  const bool restsOnTheZero = step.kind != Kind::kStiffness && step.kind != Kind::kFinish;
  if (zeroAsked_ && restsOnTheZero) refuseZero("a step of a calibration was asked for before the zero was taken");
  lastForStep_ = seen();
  std::optional<calibrate::Result> result;
  links_.slowly([&] { result = calibration_.begin(step, zero_ ? &*zero_ : nullptr, camera_, options_.directory); });
  if (result) {
    if (*result && !(*result)->path.empty()) spdlog::info("calibrated gel file written: {}", (*result)->path);
    answerStep(*result);
  }
}

void Procedures::turn() {
  measureRate();
  if (puttingBack_) puttingBack_ = !links_.putBack(*zero_);
  if (links_.takeRestPose(finished_)) keepZero();
  watchMarkers();
  if (zeroAsked_) watchZero();
  links_.watched.put({driftWatch_.drift(), zeroWithin_s()});
}

void Procedures::undoZero() {
  if (!zero_ || !before_) return answerZero(tl::unexpected<std::string>("no zero is known that was in force before"));
  if (const auto kept = links_.keep(*before_, &*zero_); !kept) {
    return answerZero(tl::unexpected("the zero is not put back, for it cannot be kept: " + kept.error().message()));
  }
  dropStep();
  std::swap(zero_, before_);
  putBack();
  links_.describe(*zero_);
  spdlog::info("the zero before is in force again, as {} asks", request_.asker);
  answerZero(*zero_);
}

void Procedures::keepZero() {
  dropStep();
  const std::string moved = zero_ ? calibrate::movedBetween(sensor_, *zero_, finished_) : "";
  // What nobody has vouched for is no measure of a touch.
  const std::string touch = zero_ && zero_->requested ? calibrate::touchSince(sensor_, *zero_, finished_)
                                                      : calibrate::touchIn(sensor_, finished_);
  if (finished_.requested) finished_.requestedBy = request_.asker;
  if (finished_.requested && zero_) {
    std::string reason;
    if (!touch.empty() && !request_.anyway) {
      reason = touch + "; take it away and ask again, or zero anyway";
    } else if (const auto kept = links_.keep(finished_, &*zero_); !kept) {
      reason = "it cannot be kept: " + kept.error().message();
    }
    if (!reason.empty()) {
      putBack();
      spdlog::warn("warning: the zero that {} asks for is refused, and the one before stays in force: {}",
                   request_.asker, reason);
      return answerZero(tl::unexpected("zero refused, the one before stays in force: " + reason));
    }
  } else if (const auto kept = links_.keep(finished_, nullptr); !kept) {
    spdlog::error("the zero is in force but not kept: {}", kept.error().message());
  }
  const std::string doubt = both(links_.judge(finished_), touch);
  before_ = std::exchange(zero_, finished_);
  links_.describe(finished_);
  spdlog::info("zero taken, {}{}{}",
               finished_.requested ? "as requested by " + request_.asker : "by itself at the first start",
               request_.anyway && finished_.requested ? ", anyway" : "", moved.empty() ? "" : "; " + moved);
  if (!doubt.empty()) spdlog::warn("warning: this may be no zero: {}", doubt);
  if (zeroAsked_ && finished_.requested) answerZero(finished_, doubt);  // else he waits for the one he asked for
}

/// Until the tracker has it, what it measures goes nowhere: that zero is not judged.
void Procedures::putBack() {
  links_.judge(*zero_);
  puttingBack_ = !links_.putBack(*zero_);
}

void Procedures::dropStep() {
  if (!calibration_.running()) return;
  calibration_.drop();
  answerStep(tl::unexpected<std::string>("a new zero was taken meanwhile"));
}

void Procedures::watchZero() {
  const track::ZeroState state = links_.zeroState();
  if (track::isRefusal(state)) return answerZero(tl::unexpected<std::string>(track::describe(state)));
  if (noFrames(lastForZero_)) return refuseZero(kNoFrames);
  if (options_.clock() > zeroUntil_ns_) {
    refuseZero(
        fmt::format("zero refused: frames come too slowly for the {} that it is averaged over", options_.zeroFrames));
  }
}

void Procedures::refuseZero(const std::string& reason) {
  // Where it is too late to take it back, the pose comes with one of the next turns, and is the answer.
  if (links_.cancelZero() || links_.zeroState() != track::ZeroState::kTaken) answerZero(tl::unexpected(reason));
}

void Procedures::answerZero(const tl::expected<RestPose, std::string>& result, const std::string& remark) {
  zeroAsked_ = false;
  links_.answerZero(result, remark);
}

void Procedures::answerStep(const calibrate::Result& result) {
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
    if (const auto result = calibration_.add(markers_)) answerStep(*result);
  }
  if (calibration_.running() && noFrames(lastForStep_)) {
    calibration_.drop();
    answerStep(tl::unexpected<std::string>(kNoFrames));
  }
}

void Procedures::measureRate() {
  const Seen now = seen();
  if (rateSince_.at_ns == 0) rateSince_ = now;
  if (now.frames == rateSince_.frames || now.at_ns - rateSince_.at_ns < kRateOver_ns) return;
  rate_Hz_ =
      static_cast<double>(now.frames - rateSince_.frames) * 1e9 / static_cast<double>(now.at_ns - rateSince_.at_ns);
  rateSince_ = now;
}

double Procedures::zeroWithin_s() const {
  const double noFrames_s = 1e-9 * static_cast<double>(kNoFrames_ns);
  const double frame_s = rate_Hz_ > 0.0 ? std::min(1.0 / rate_Hz_, noFrames_s) : noFrames_s;
  return noFrames_s + frame_s * (kZeroFrames * options_.zeroFrames + kUnderWay);
}

Procedures::Seen Procedures::seen() const {
  return {links_.frames.get(), options_.clock()};
}

bool Procedures::noFrames(Seen& last) const {
  const Seen now = seen();
  if (last.frames != now.frames) last = now;
  return now.at_ns - last.at_ns > kNoFrames_ns;
}

}  // namespace tractiond
