#include "daemon/control/zero_procedure.h"

#include "daemon/calibrate/zero_check.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cassert>
#include <chrono>
#include <utility>

namespace tractiond::control {
namespace {

/// Frames that a zero may take: a multiple of those averaged, since as many again may be torn; and frames under way.
constexpr int kZeroFrames = 2, kUnderWay = 2;

/// Joins two sentences, either of which may be empty.
std::string both(const std::string& one, const std::string& other) {
  return one + (one.empty() || other.empty() ? "" : "; ") + other;
}

bool isDone(const std::future<ZeroProcedure::Written>& write) {
  return write.valid() && write.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

}  // namespace

void ZeroProcedure::restore(const std::optional<RestPose>& restored, const std::optional<RestPose>& before) {
  zero_ = restored;
  before_ = before;
  if (!zero_) return;
  const GelReport report = parts_.gel.compare(*zero_);
  takeReport(*zero_, report);
  const std::string doubt = both(report.doubt(), calibrate::touchIn(parts_.sensor, *zero_));
  if (!doubt.empty()) spdlog::warn("warning: the stored zero may be wrong: {}", doubt);
  parts_.host.describe(*zero_);
}

void ZeroProcedure::begin(const ZeroRequest& request) {
  assert(std::holds_alternative<Idle>(state_));
  request_ = request;
  if (request.undo) return undo();
  const std::int64_t now_ns = options_.clock();
  state_ =
      Taking{.until_ns = now_ns + static_cast<std::int64_t>(1e9 * takenWithin_s()), .frames = {parts_.frames, now_ns}};
  parts_.tracker.requestZero();
}

void ZeroProcedure::refuse(const std::string& reason) {
  if (!std::holds_alternative<Taking>(state_)) return;  // the end of the write is the answer
  // If it is too late to cancel, the pose arrives in one of the next turns and is the answer.
  if (parts_.tracker.cancelZero() || parts_.tracker.zeroState() != track::ZeroState::kTaken)
    answer(tl::unexpected(reason));
}

void ZeroProcedure::turn() {
  if (!isHandedOver_) handOver();
  handleWritten();
  if (!std::holds_alternative<Keeping>(state_) && parts_.tracker.takeRestPose(taken_)) handleTaken();
  if (auto* const taking = std::get_if<Taking>(&state_)) watchTaking(*taking);
}

void ZeroProcedure::undo() {
  if (!zero_ || !before_) return answer(tl::unexpected<std::string>("there is no previous zero"));
  keep({.zero = *before_, .report = parts_.gel.compare(*before_), .doubt = {}, .moved = {}, .written = {}});
}

/// Handles a zero that the tracker has taken. The first one is in force already; a requested one comes into force when
/// it has been written.
void ZeroProcedure::handleTaken() {
  const auto* const taking = std::get_if<Taking>(&state_);
  if (zero_ && !(taking && taken_.requested)) return handOver();  // its request has been answered with an error
  dropStep();
  // A zero that no operator has requested may itself have been taken under load.
  const std::string touch = zero_ && zero_->requested ? calibrate::touchSince(parts_.sensor, *zero_, taken_)
                                                      : calibrate::touchIn(parts_.sensor, taken_);
  const std::string recovering = zero_ ? calibrate::recovering(newest_) : "";
  const std::string moved = zero_ ? calibrate::movedBetween(parts_.sensor, *zero_, taken_) : "";
  if (taken_.requested) taken_.requestedBy = request_.asker;
  if (zero_ && !touch.empty() && !request_.anyway)
    return refuseTaken(touch + "; remove it and try again, or use: tractionctl zero --anyway");
  if (!recovering.empty() && !request_.anyway)
    return refuseTaken(recovering + "; wait and try again, or use: tractionctl zero --anyway");
  const GelReport report = parts_.gel.compare(taken_);
  const std::string doubt = both(both(report.doubt(), touch), recovering);
  if (zero_) return keep({.zero = taken_, .report = report, .doubt = doubt, .moved = moved, .written = {}});
  logTaken(doubt, moved);
  adoptFirst(report, doubt);
}

/// Puts the first zero in force at once, and starts to write it.
void ZeroProcedure::adoptFirst(const GelReport& report, const std::string& doubt) {
  zero_ = taken_;
  takeReport(taken_, report);
  parts_.host.describe(taken_);
  if (taken_.requested) {
    handOver();  // the tracker may use an earlier first zero
    if (!std::holds_alternative<Idle>(state_)) answer(taken_, doubt);
  }
  ownWritten_ = parts_.host.keep(taken_, nullptr);
}

void ZeroProcedure::logTaken(const std::string& doubt, const std::string& moved) const {
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

void ZeroProcedure::keep(Keeping keeping) {
  keeping.written = parts_.host.keep(keeping.zero, &*zero_);
  state_ = std::move(keeping);
  handleWritten();
}

/// Puts the requested zero in force when it is on the disk, or refuses it. Logs that the one in force could not
/// be written.
void ZeroProcedure::handleWritten() {
  if (isDone(ownWritten_)) {
    if (const Written written = ownWritten_.get(); !written)
      spdlog::error("the zero in force could not be written: {}", written.error().message());
  }
  const auto* const keeping = std::get_if<Keeping>(&state_);
  if (keeping == nullptr || !isDone(keeping->written)) return;
  auto kept = std::get<Keeping>(std::exchange(state_, Idle{}));
  if (const Written written = kept.written.get(); !written) {
    const std::string why = written.error().message();
    // A write that fails late leaves the refused zero on the disk, from where the next start would restore it.
    ownWritten_ = parts_.host.keep(*zero_, before_ ? &*before_ : nullptr);
    if (!request_.undo) return refuseTaken("it could not be written: " + why);
    return answer(tl::unexpected("previous zero not restored, because it could not be written: " + why));
  }
  dropStep();
  if (request_.undo) {
    spdlog::info("previous zero restored, as requested by {}", request_.asker);
  } else {
    logTaken(kept.doubt, kept.moved);
  }
  putInForce(kept.zero, kept.report);
  answer(*zero_, kept.doubt);
}

/// Puts a zero in force that has been compared and written, and publishes the description.
void ZeroProcedure::putInForce(const RestPose& zero, const GelReport& report) {
  takeReport(zero, report);
  if (zero.id != zero_->id) {
    before_ = std::exchange(zero_, zero);
    parts_.host.describe(*zero_);
  }
  handOver();
}

/// Stores and reports the result of the comparison for a zero that comes into force.
void ZeroProcedure::takeReport(const RestPose& zero, const GelReport& report) {
  fits_ = report.fits();
  parts_.gel.report(zero, report);
}

/// Hands the zero in force to the tracker, which drops a zero that it has taken since.
void ZeroProcedure::handOver() {
  isHandedOver_ = parts_.tracker.putInForce(*zero_, fits_);
}

/// Refuses the open request if the tracker refuses, or frames arrive too slowly or not at all.
void ZeroProcedure::watchTaking(Taking& taking) {
  const track::ZeroState state = parts_.tracker.zeroState();
  if (track::isRefusal(state)) return answer(tl::unexpected<std::string>(track::describe(state)));
  if (taking.frames.idle_ns(parts_.frames, options_.clock()) > kNoFrames_ns) return refuse(noFrames(waits_));
  if (options_.clock() > taking.until_ns) {
    refuse(
        fmt::format("zero refused: frames come too slowly for the {} that it is averaged over", options_.zeroFrames));
  }
}

/// Ends a step that measures from the zero which is about to be replaced.
void ZeroProcedure::dropStep() {
  steps_.drop("a new zero was taken meanwhile");
}

void ZeroProcedure::answer(const tl::expected<RestPose, std::string>& result, const std::string& remark) {
  state_ = Idle{};
  parts_.replies.answerZero(result, remark);
}

double ZeroProcedure::answeredWithin_s() const {
  double taken_s = takenWithin_s();
  if (const auto* const taking = std::get_if<Taking>(&state_))
    taken_s = std::max(taken_s, 1e-9 * static_cast<double>(taking->until_ns - options_.clock()));
  return taken_s + 1e-9 * static_cast<double>(kKeptWithin_ns);
}

/// Returns the time within which the tracker takes a zero or refuses it [s].
double ZeroProcedure::takenWithin_s() const {
  const double noFrames_s = 1e-9 * static_cast<double>(kNoFrames_ns);
  const double frame_s = rate_Hz_ > 0.0 ? std::min(1.0 / rate_Hz_, noFrames_s) : noFrames_s;
  return noFrames_s + frame_s * (kZeroFrames * options_.zeroFrames + kUnderWay);
}

}  // namespace tractiond::control
