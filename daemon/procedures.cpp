#include "daemon/procedures.h"

#include "daemon/calibrate/zero_check.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <utility>

namespace tractiond {
namespace {

constexpr const char* kNoFrames = "no frames come from the camera";
constexpr const char* kDiskHangs = "it was not written to the disk within a minute";

/// The rate is measured over at least this long.
constexpr std::int64_t kRateOver_ns = 2'000'000'000;

/// Of the frames that a zero may take: as many again may be torn, one may be under way.
constexpr int kZeroFrames = 2, kUnderWay = 2;

/// Time until the next try to write the zero in force.
constexpr std::int64_t kTryAgain_ns = 10'000'000'000;

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
    , steps_(sensor, {.zeroFrames = options_.zeroFrames},
             {.start = links_.startWork,
              .answer = [this](const auto& result) { answerStep(result); },
              .clock = options_.clock}) {
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
  if (!zero_) {
    spdlog::info("no zero is kept: the first {} still frames are taken for it", options_.zeroFrames);
    return;
  }
  spdlog::info("the zero is the one kept in {}", options_.directory.string());
  const GelReport report = links_.judge(*zero_);
  heedJudgement(*zero_, report);
  const std::string doubt = both(report.doubt(), calibrate::touchIn(sensor_, *zero_));
  if (!doubt.empty()) spdlog::warn("warning: the stored zero may be wrong: {}", doubt);
  links_.describe(*zero_);
}

void Procedures::beginZero(const ZeroRequest& request) {
  zeroAsked_ = true;
  request_ = request;
  if (keeping_ && options_.clock() > keeping_->until_ns)
    return answerZero(tl::unexpected<std::string>("the disk has not finished writing the last zero"));
  if (request.undo) return undoZero();
  lastForZero_ = seen();
  zeroUntil_ns_ = lastForZero_.at_ns + static_cast<std::int64_t>(1e9 * takenWithin_s());
  links_.requestZero();
}

void Procedures::beginStep(const CalibrationStep& step) {
  using Kind = CalibrationStep::Kind;
  const bool restsOnTheZero = step.kind != Kind::kStiffness && step.kind != Kind::kFinish;
  if (zeroAsked_ && restsOnTheZero) refuseZero("a step of a calibration was asked for before the zero was taken");
  lastForStep_ = seen();
  steps_.begin(step, zero_, camera_, options_.directory);
}

void Procedures::turn() {
  measureRate();
  if (puttingInForce_) handOver();
  if (keeping_) watchKeeping();
  if (!keeping_ && rewriteAt_ns_ && options_.clock() >= *rewriteAt_ns_) rewrite();
  if (!keeping_ && links_.takeRestPose(finished_)) heedTaken();
  watchMarkers();
  if (zeroAsked_) watchZero();
  links_.watched.put({driftWatch_.drift(), takenWithin_s() + 1e-9 * static_cast<double>(kKeptWithin_ns)});
}

void Procedures::undoZero() {
  if (keeping_) return answerZero(tl::unexpected<std::string>("a zero is being written to the disk; ask again"));
  if (!zero_ || !before_) return answerZero(tl::unexpected<std::string>("there is no previous zero"));
  keep(*before_, &*zero_, true, [this, report = links_.judge(*before_)](const tl::expected<void, Error>& kept) {
    if (!kept)
      return answerZero(
          tl::unexpected("previous zero not restored, because it could not be written: " + kept.error().message()));
    dropStep();
    putInForce(*before_, report);
    spdlog::info("previous zero restored, as requested by {}", request_.asker);
    answerZero(*zero_);
  });
}

/// Handles a zero that the tracker has taken. The first one is in force already; a requested one comes into force when
/// it has been written.
void Procedures::heedTaken() {
  if (finished_.requested && zero_ && !zeroAsked_) return handOver();  // its request has been answered with an error
  dropStep();
  // A zero that no operator has requested may itself have been taken under load.
  const std::string touch = zero_ && zero_->requested ? calibrate::touchSince(sensor_, *zero_, finished_)
                                                      : calibrate::touchIn(sensor_, finished_);
  const std::string moved = zero_ ? calibrate::movedBetween(sensor_, *zero_, finished_) : "";
  if (finished_.requested) finished_.requestedBy = request_.asker;
  const auto refuse = [this](const std::string& reason) {
    handOver();
    spdlog::warn("warning: the zero requested by {} is refused, the previous one stays in force: {}", request_.asker,
                 reason);
    answerZero(tl::unexpected("zero refused, the previous one stays in force: " + reason));
  };
  if (zero_ && !touch.empty() && !request_.anyway)
    return refuse(touch + "; remove it and try again, or use: tractionctl zero --anyway");
  const GelReport report = links_.judge(finished_);
  const std::string doubt = both(report.doubt(), touch);
  const auto tell = [this, doubt, moved] {
    spdlog::info("zero taken, {}{}{}",
                 finished_.requested ? "as requested by " + request_.asker : "by itself at the first start",
                 request_.anyway && finished_.requested ? ", anyway" : "", moved.empty() ? "" : "; " + moved);
    if (!doubt.empty()) spdlog::warn("warning: this zero may be wrong: {}", doubt);
  };
  if (!zero_) {
    tell();
    zero_ = finished_;
    heedJudgement(finished_, report);
    links_.describe(finished_);
    if (finished_.requested) handOver();  // in case an earlier first zero was never read
    if (zeroAsked_ && finished_.requested) answerZero(finished_, doubt);  // else the requested one is still to come
    return keep(finished_, nullptr, false, [this](const auto& kept) { tellRewritten(kept); });
  }
  keep(finished_, &*zero_, true, [this, report, doubt, tell, refuse](const tl::expected<void, Error>& kept) {
    if (!kept) return refuse("it could not be written: " + kept.error().message());
    tell();
    putInForce(finished_, report);
    answerZero(finished_, doubt);
  });
}

void Procedures::keep(const RestPose& zero, const RestPose* before, bool isAwaited,
                      std::function<void(const tl::expected<void, Error>&)> then) {
  std::int64_t until_ns = options_.clock() + kKeptWithin_ns;
  // An earlier write may have held this one up.
  if (isAwaited && zeroAsked_ && !request_.undo) until_ns = std::min(until_ns, zeroUntil_ns_ + kKeptWithin_ns);
  keeping_ = {.done = links_.keep(zero, before), .until_ns = until_ns, .isAwaited = isAwaited, .then = std::move(then)};
  watchKeeping();
}

/// Ends the write that is under way when it is done. A zero that was refused because its write failed or took too long
/// may be on the disk all the same: it is overwritten by the one in force.
void Procedures::watchKeeping() {
  if (keeping_->done.wait_for(std::chrono::seconds(0)) == std::future_status::ready) {
    Keeping keeping = *std::exchange(keeping_, std::nullopt);
    const tl::expected<void, Error> kept = keeping.done.get();
    if (keeping.isRefused || (!kept && keeping.isAwaited)) {
      rewriteAt_ns_ = options_.clock();
    } else if (!kept) {
      rewriteAt_ns_ = options_.clock() + kTryAgain_ns;
    } else {
      rewriteAt_ns_.reset();
    }
    if (!keeping.isRefused) keeping.then(kept);
    return;
  }
  if (!keeping_->isAwaited || options_.clock() <= keeping_->until_ns) return;
  keeping_->isAwaited = false;
  keeping_->isRefused = true;
  keeping_->then(tl::unexpected(Error{.what = kDiskHangs}));
}

/// Writes the zero in force once more.
void Procedures::rewrite() {
  keep(*zero_, before_ ? &*before_ : nullptr, false, [this](const auto& kept) { tellRewritten(kept); });
}

void Procedures::tellRewritten(const tl::expected<void, Error>& kept) {
  if (kept && std::exchange(isUnwritten_, false)) spdlog::info("the zero in force has been written to the disk");
  if (!kept && !std::exchange(isUnwritten_, true)) {
    spdlog::error("the zero in force could not be written, which is tried again every 10 s: {}",
                  kept.error().message());
  }
}

/// Puts a zero in force that has been judged and kept, and describes it.
void Procedures::putInForce(const RestPose& zero, const GelReport& report) {
  heedJudgement(zero, report);
  if (zero.id != zero_->id) {
    before_ = std::exchange(zero_, zero);
    links_.describe(*zero_);
  }
  handOver();
}

/// Remembers and tells what has been found of a zero that comes into force.
void Procedures::heedJudgement(const RestPose& zero, const GelReport& report) {
  fits_ = report.fits();
  links_.tellJudgement(zero, report);
}

/// Hands the zero in force to the tracker, which drops what it has taken since.
void Procedures::handOver() {
  puttingInForce_ = !links_.putInForce(*zero_, fits_);
}

void Procedures::dropStep() {
  steps_.drop("a new zero was taken meanwhile");
}

void Procedures::watchZero() {
  if (keeping_ && keeping_->isAwaited) return;
  if (keeping_ && options_.clock() > zeroUntil_ns_ + kKeptWithin_ns) {
    links_.cancelZero();
    return answerZero(tl::unexpected<std::string>(kDiskHangs));
  }
  const track::ZeroState state = links_.zeroState();
  if (track::isRefusal(state)) return answerZero(tl::unexpected<std::string>(track::describe(state)));
  if (noFrames(lastForZero_)) return refuseZero(kNoFrames);
  if (options_.clock() > zeroUntil_ns_) {
    refuseZero(
        fmt::format("zero refused: frames come too slowly for the {} that it is averaged over", options_.zeroFrames));
  }
}

void Procedures::refuseZero(const std::string& reason) {
  if (keeping_ && keeping_->isAwaited) return;  // the end of the write is the answer, also of an undo
  // Where it is too late to take it back, the pose comes with one of the next turns, and is the answer.
  if (links_.cancelZero() || links_.zeroState() != track::ZeroState::kTaken) answerZero(tl::unexpected(reason));
}

void Procedures::answerZero(const tl::expected<RestPose, std::string>& result, const std::string& remark) {
  zeroAsked_ = false;
  links_.answerZero(result, remark);
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
  if (steps_.isLooking() && noFrames(lastForStep_)) steps_.drop(kNoFrames);
}

void Procedures::measureRate() {
  const Seen now = seen();
  if (rateSince_.at_ns == 0) rateSince_ = now;
  if (now.frames == rateSince_.frames || now.at_ns - rateSince_.at_ns < kRateOver_ns) return;
  rate_Hz_ =
      static_cast<double>(now.frames - rateSince_.frames) * 1e9 / static_cast<double>(now.at_ns - rateSince_.at_ns);
  rateSince_ = now;
}

double Procedures::takenWithin_s() const {
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
