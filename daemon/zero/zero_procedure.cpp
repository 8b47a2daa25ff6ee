#include "daemon/zero/zero_procedure.h"

#include "daemon/calibrate/zero_check.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <utility>

namespace tractiond::zero {
namespace {

constexpr const char* kDiskHangs = "it was not written to the disk within a minute";

/// Of the frames that a zero may take: as many again may be torn, one may be under way.
constexpr int kZeroFrames = 2, kUnderWay = 2;

/// Time until the next try to write the zero in force.
constexpr std::int64_t kTryAgain_ns = 10'000'000'000;

/// Two sentences, either of which may be empty.
std::string both(const std::string& one, const std::string& other) {
  return one + (one.empty() || other.empty() ? "" : "; ") + other;
}

}  // namespace

ZeroProcedure::ZeroProcedure(const sensor::Sensor& sensor, int zeroFrames, std::int64_t (*clock)(),
                             const Counter& frames, ZeroLinks links, std::function<void()> onChange)
    : sensor_(sensor)
    , zeroFrames_(zeroFrames)
    , clock_(clock)
    , frames_(frames)
    , links_(std::move(links))
    , onChange_(std::move(onChange)) {}

void ZeroProcedure::welcome(const std::optional<RestPose>& restored, const std::optional<RestPose>& before) {
  zero_ = restored;
  before_ = before;
  if (!zero_) return;
  const GelReport report = links_.judge(*zero_);
  heedJudgement(*zero_, report);
  const std::string doubt = both(report.doubt(), calibrate::touchIn(sensor_, *zero_));
  if (!doubt.empty()) spdlog::warn("warning: the stored zero may be wrong: {}", doubt);
  links_.describe(*zero_);
}

void ZeroProcedure::begin(const ZeroRequest& request) {
  const std::int64_t now_ns = clock_();
  open_ = {.until_ns = now_ns + static_cast<std::int64_t>(1e9 * takenWithin_s()), .frames = {frames_, now_ns}};
  request_ = request;
  if (keeping_ && now_ns > keeping_->until_ns)
    return answer(tl::unexpected<std::string>("the disk has not finished writing the last zero"));
  if (request.undo) return undo();
  links_.request();
}

void ZeroProcedure::refuse(const std::string& reason) {
  if (!open_) return;
  if (keeping_ && keeping_->isAwaited) return;  // the end of the write is the answer, also of an undo
  // Where it is too late to take it back, the pose comes with one of the next turns, and is the answer.
  if (links_.cancel() || links_.state() != track::ZeroState::kTaken) answer(tl::unexpected(reason));
}

void ZeroProcedure::turn() {
  if (!isHandedOver_) handOver();
  if (keeping_) watchKeeping();
  if (!keeping_ && rewriteAt_ns_ && clock_() >= *rewriteAt_ns_) rewrite();
  if (!keeping_ && links_.take(taken_)) heedTaken();
  if (open_) watchTaking();
}

void ZeroProcedure::undo() {
  if (keeping_) return answer(tl::unexpected<std::string>("a zero is being written to the disk; ask again"));
  if (!zero_ || !before_) return answer(tl::unexpected<std::string>("there is no previous zero"));
  keep(*before_, &*zero_, true, [this, report = links_.judge(*before_)](const Kept& kept) {
    if (!kept)
      return answer(
          tl::unexpected("previous zero not restored, because it could not be written: " + kept.error().message()));
    onChange_();
    putInForce(*before_, report);
    spdlog::info("previous zero restored, as requested by {}", request_.asker);
    answer(*zero_);
  });
}

/// Handles a zero that the tracker has taken. The first one is in force already; a requested one comes into force when
/// it has been written.
void ZeroProcedure::heedTaken() {
  if (taken_.requested && zero_ && !open_) return handOver();  // its request has been answered with an error
  onChange_();
  // A zero that no operator has requested may itself have been taken under load.
  const std::string touch =
      zero_ && zero_->requested ? calibrate::touchSince(sensor_, *zero_, taken_) : calibrate::touchIn(sensor_, taken_);
  const std::string moved = zero_ ? calibrate::movedBetween(sensor_, *zero_, taken_) : "";
  if (taken_.requested) taken_.requestedBy = request_.asker;
  if (zero_ && !touch.empty() && !request_.anyway)
    return refuseTaken(touch + "; remove it and try again, or use: tractionctl zero --anyway");
  const GelReport report = links_.judge(taken_);
  const std::string doubt = both(report.doubt(), touch);
  if (!zero_) {
    tellTaken(doubt, moved);
    return adoptFirst(report, doubt);
  }
  keep(taken_, &*zero_, true, [this, report, doubt, moved](const Kept& kept) {
    if (!kept) return refuseTaken("it could not be written: " + kept.error().message());
    tellTaken(doubt, moved);
    putInForce(taken_, report);
    answer(taken_, doubt);
  });
}

/// The first zero is in force at once, and written meanwhile.
void ZeroProcedure::adoptFirst(const GelReport& report, const std::string& doubt) {
  zero_ = taken_;
  heedJudgement(taken_, report);
  links_.describe(taken_);
  if (taken_.requested) handOver();                      // in case an earlier first zero was never read
  if (open_ && taken_.requested) answer(taken_, doubt);  // else the requested one is still to come
  keep(taken_, nullptr, false, [this](const Kept& kept) { tellRewritten(kept); });
}

void ZeroProcedure::tellTaken(const std::string& doubt, const std::string& moved) const {
  spdlog::info("zero taken, {}{}{}",
               taken_.requested ? "as requested by " + request_.asker : "by itself at the first start",
               request_.anyway && taken_.requested ? ", anyway" : "", moved.empty() ? "" : "; " + moved);
  if (!doubt.empty()) spdlog::warn("warning: this zero may be wrong: {}", doubt);
}

void ZeroProcedure::refuseTaken(const std::string& reason) {
  handOver();
  spdlog::warn("warning: the zero requested by {} is refused, the previous one stays in force: {}", request_.asker,
               reason);
  answer(tl::unexpected("zero refused, the previous one stays in force: " + reason));
}

void ZeroProcedure::keep(const RestPose& zero, const RestPose* before, bool isAwaited,
                         std::function<void(const Kept&)> then) {
  std::int64_t until_ns = clock_() + kKeptWithin_ns;
  // An earlier write may have held this one up.
  if (isAwaited && open_ && !request_.undo) until_ns = std::min(until_ns, open_->until_ns + kKeptWithin_ns);
  keeping_ = {.done = links_.keep(zero, before), .until_ns = until_ns, .isAwaited = isAwaited, .then = std::move(then)};
  watchKeeping();
}

/// Ends the write that is under way when it is done. A zero that was refused because its write failed or took too long
/// may be on the disk all the same: it is overwritten by the one in force.
void ZeroProcedure::watchKeeping() {
  if (keeping_->done.wait_for(std::chrono::seconds(0)) == std::future_status::ready) {
    Keeping keeping = *std::exchange(keeping_, std::nullopt);
    const Kept kept = keeping.done.get();
    if (keeping.isRefused || (!kept && keeping.isAwaited)) {
      rewriteAt_ns_ = clock_();
    } else if (!kept) {
      rewriteAt_ns_ = clock_() + kTryAgain_ns;
    } else {
      rewriteAt_ns_.reset();
    }
    if (!keeping.isRefused) keeping.then(kept);
    return;
  }
  if (!keeping_->isAwaited || clock_() <= keeping_->until_ns) return;
  keeping_->isAwaited = false;
  keeping_->isRefused = true;
  keeping_->then(tl::unexpected(Error{.what = kDiskHangs}));
}

/// Writes the zero in force once more.
void ZeroProcedure::rewrite() {
  keep(*zero_, before_ ? &*before_ : nullptr, false, [this](const Kept& kept) { tellRewritten(kept); });
}

void ZeroProcedure::tellRewritten(const Kept& kept) {
  if (kept && std::exchange(isUnwritten_, false)) spdlog::info("the zero in force has been written to the disk");
  if (!kept && !std::exchange(isUnwritten_, true)) {
    spdlog::error("the zero in force could not be written, which is tried again every 10 s: {}",
                  kept.error().message());
  }
}

/// Puts a zero in force that has been judged and kept, and describes it.
void ZeroProcedure::putInForce(const RestPose& zero, const GelReport& report) {
  heedJudgement(zero, report);
  if (zero.id != zero_->id) {
    before_ = std::exchange(zero_, zero);
    links_.describe(*zero_);
  }
  handOver();
}

/// Remembers and tells what has been found of a zero that comes into force.
void ZeroProcedure::heedJudgement(const RestPose& zero, const GelReport& report) {
  fits_ = report.fits();
  links_.tellJudgement(zero, report);
}

/// Hands the zero in force to the tracker, which drops what it has taken since.
void ZeroProcedure::handOver() {
  isHandedOver_ = links_.putInForce(*zero_, fits_);
}

/// Refuses the open request where the tracker does, or frames come too slowly or not at all.
void ZeroProcedure::watchTaking() {
  if (keeping_ && keeping_->isAwaited) return;
  if (keeping_ && clock_() > open_->until_ns + kKeptWithin_ns) {
    links_.cancel();
    return answer(tl::unexpected<std::string>(kDiskHangs));
  }
  const track::ZeroState state = links_.state();
  if (track::isRefusal(state)) return answer(tl::unexpected<std::string>(track::describe(state)));
  if (open_->frames.idle_ns(frames_, clock_()) > kNoFrames_ns) return refuse(kNoFrames);
  if (clock_() > open_->until_ns) {
    refuse(fmt::format("zero refused: frames come too slowly for the {} that it is averaged over", zeroFrames_));
  }
}

void ZeroProcedure::answer(const tl::expected<RestPose, std::string>& result, const std::string& remark) {
  open_.reset();
  links_.answer(result, remark);
}

/// Time within which the tracker has taken a zero, or refused it [s].
double ZeroProcedure::takenWithin_s() const {
  const double noFrames_s = 1e-9 * static_cast<double>(kNoFrames_ns);
  const double frame_s = rate_Hz_ > 0.0 ? std::min(1.0 / rate_Hz_, noFrames_s) : noFrames_s;
  return noFrames_s + frame_s * (kZeroFrames * zeroFrames_ + kUnderWay);
}

}  // namespace tractiond::zero
