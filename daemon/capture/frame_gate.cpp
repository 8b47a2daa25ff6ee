// Strategy. Sorts whole pictures of the agreed shape into tracks. A picture continues a track if its id and its time
// come after those of the track's last picture, the id has not advanced by more than the elapsed time allows, and the
// camera's clock keeps step with the host's. A picture that continues the current track is new. Every other picture is
// held back: it starts or continues the candidate, of which there is one. A candidate of three pictures replaces the
// current track if no frame of the current track arrived meanwhile. So a single odd picture is never used, whatever it
// claims, and a camera whose counter starts anew is used again after three frames. A picture with the id and the time
// of an earlier one is a repetition of it: it is stale, and part of no candidate.
//
// Some cameras have no usable clock: they send 0 or whole seconds, or their time goes back. A picture with the next id
// is new whatever the camera's clock says. Where the clock contradicts the id, it is distrusted for a hundred frames:
// ids are then compared with the host's clock, and repetitions are recognised by their content.
//
// A host that sends with the camera's address can forge every input but the host's clock (docs/security.md).
#include "daemon/capture/frame_gate.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tractiond::capture {
namespace {

constexpr int kAgreeing = 3;
/// Number of equal pictures in a row from which on they are not new: a source of a quarter of the camera's rate shows
/// each of its pictures four times.
constexpr int kRepeating = 5;
/// Times between frames in the mean: of so many first ones each counts the same, as the very first may be any.
constexpr int kMostPaces = 16;
/// Frames without a fault until a camera's clock is believed again.
constexpr int kDistrust = 100;
constexpr std::uint64_t kLast16BitId = 65535;
/// A camera clock that gains more than this on the host's has stepped: a picture cannot arrive before it is taken.
/// Larger than the jitter of a camera that stamps by its own operating system, and than a change of exposure time.
constexpr std::int64_t kAhead_ns = 50'000'000;
/// A camera clock that falls behind by more has stepped, or the host slept. Larger than any delay of a working host.
constexpr std::int64_t kBehind_ns = 1'000'000'000;
/// Largest delay with which a camera's operating system stamps a frame: ids may outrun the stamps by that.
constexpr std::int64_t kStampJitter_ns = 8'000'000;
/// Shortest frame period of any camera: bounds a gap of ids while the period is not known yet.
constexpr std::int64_t kShortestPeriod_ns = 100'000;

/// a - b as the two's complement says; ids and times from outside may be anything.
std::int64_t difference(std::int64_t a, std::int64_t b) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b));
}

/// By how much `id` is ahead of `last`; 0 or less than 0: it is not. An id above 65535 shows a 64-bit counter. All
/// others may be of a 16-bit one: a circle of 65535 without the 0, of which one half lies ahead.
std::int64_t advance(std::uint64_t last, std::uint64_t id) {
  if (last > kLast16BitId || id > kLast16BitId) return static_cast<std::int64_t>(id - last);
  const std::int64_t round =
      (static_cast<std::int64_t>(id) - static_cast<std::int64_t>(last) + static_cast<std::int64_t>(kLast16BitId)) %
      static_cast<std::int64_t>(kLast16BitId);
  return round <= static_cast<std::int64_t>(kLast16BitId / 2) ? round : round - static_cast<std::int64_t>(kLast16BitId);
}

/// Returns by how much an id may advance in `elapsed_ns` (by either clock, at least 0), at least 1.
/// \param period_ns of the frames; 0: not known
std::uint64_t largestStep(std::int64_t period_ns, std::int64_t elapsed_ns) {
  const std::int64_t period = std::max(period_ns, kShortestPeriod_ns);
  const std::int64_t most = elapsed_ns > INT64_MAX - kStampJitter_ns ? INT64_MAX : elapsed_ns + kStampJitter_ns;
  return std::max<std::uint64_t>(1, static_cast<std::uint64_t>(most / period));
}

}  // namespace

FrameGate::Track FrameGate::begin(const Arrival& arrival) {
  Track track;
  track.id = arrival.id;
  track.device_ns = arrival.device_ns;
  track.host_ns = arrival.host_ns;
  track.offset_ns = difference(arrival.host_ns, arrival.device_ns);
  track.distrust = arrival.device_ns == 0 ? kDistrust : 0;
  return track;
}

void FrameGate::extend(Track& track, const Arrival& arrival, Fit fit) {
  const std::int64_t step = advance(track.id, arrival.id);
  const std::int64_t pace = (arrival.host_ns - track.host_ns) / step;
  track.paces = std::min(track.paces + 1, kMostPaces);
  track.pace_ns += (pace - track.pace_ns) / track.paces;
  const std::int64_t offset = difference(arrival.host_ns, arrival.device_ns);
  if (fit == Fit::kByBothClocks) {
    const std::int64_t period = difference(arrival.device_ns, track.device_ns) / step;
    track.period_ns = track.period_ns == 0 ? period : std::min(period, track.period_ns + track.period_ns / 64 + 1);
    // 1 part in 1000: more than any crystal's drift.
    const std::int64_t leak = (arrival.host_ns - track.host_ns) / 1000;
    track.offset_ns = difference(track.offset_ns, -std::min(difference(offset, track.offset_ns), leak));
    track.distrust = std::max(0, track.distrust - 1);
  } else {
    track.offset_ns = offset;
    track.distrust = kDistrust;
  }
  track.id = arrival.id;
  track.device_ns = arrival.device_ns;
  track.host_ns = arrival.host_ns;
  track.length = std::min(track.length + 1, kAgreeing);
}

FrameGate::Fit FrameGate::follows(const Track& track, const Arrival& arrival) {
  const std::int64_t step = advance(track.id, arrival.id);
  if (step <= 0) return Fit::kNone;
  const std::int64_t elapsed = difference(arrival.device_ns, track.device_ns);
  const std::int64_t lag = difference(difference(arrival.host_ns, arrival.device_ns), track.offset_ns);
  if (elapsed > 0 && static_cast<std::uint64_t>(step) <= largestStep(track.period_ns, elapsed) && lag >= -kAhead_ns &&
      lag <= kBehind_ns)
    return Fit::kByBothClocks;
  // One more than the mean pace: frames reach the host less evenly than the camera takes them.
  const std::int64_t most =
      track.distrust > 0 && track.pace_ns > 0 ? 1 + (arrival.host_ns - track.host_ns) / track.pace_ns : 1;
  return step <= most ? Fit::kByTheHosts : Fit::kNone;
}

/// Returns whether a frame, whole or damaged, may be the next of a track by its id and the host's clock alone.
bool FrameGate::isNext(const Track& track, const Arrival& arrival) {
  const std::int64_t step = advance(track.id, arrival.id);
  return step > 0 && track.pace_ns > 0 && step <= 2 + 2 * ((arrival.host_ns - track.host_ns) / track.pace_ns);
}

/// Returns the shortest time [ns] between two frames of a track; 0: not known. A break of the network
/// lengthens the mean, not the period.
std::int64_t FrameGate::frameTime(const Track& track) {
  return track.period_ns > 0 ? std::min(track.period_ns, track.pace_ns) : track.pace_ns;
}

/// Returns the time [ns] between two frames of a track by the clock that shows more; 0: not known. Frames that waited
/// reach the host at once, as the first ones of a camera that is being opened.
std::int64_t FrameGate::longestMean(const Track& track) {
  return std::max(track.pace_ns, track.period_ns);
}

void FrameGate::markArrived(const Arrival& arrival) {
  if (!current_) return;
  const bool isAnId = arrival.id != 0 || options_.zeroIsAnId;
  const std::int64_t step = isAnId ? advance(current_->id, arrival.id) : 0;
  if (step > 0 && step < static_cast<std::int64_t>(arrived_.size()))
    arrived_.set(static_cast<std::size_t>(step));
  else if (!arrival.complete)
    ++arrivedUnnamed_;
}

bool FrameGate::seenBefore(const Arrival& arrival) const {
  const auto end = history_.begin() + static_cast<std::ptrdiff_t>(std::min(historyCount_, history_.size()));
  // The same id and time say enough where the times are good; else the content decides.
  const bool clockIsGood = current_ && current_->distrust == 0;
  return std::any_of(history_.begin(), end, [&](const Seen& seen) {
    return seen.id == arrival.id && seen.device_ns == arrival.device_ns &&
           (clockIsGood || seen.content == arrival.content);
  });
}

/// Returns the time [ns] from a frame to the next one by the clock that shows less: where the next one only comes late,
/// the host's shows too much. Both must have trusted stamps of one timeline.
std::int64_t FrameGate::elapsed(const Track& from, const Track& to) {
  return std::min(to.host_ns - from.host_ns, difference(to.device_ns, from.device_ns));
}

/// A driver throws away what is a little older than its newest frame, and so the first frames of a counter that starts
/// anew. No more than the time since the last new frame has room for: packets may also come twice.
std::uint64_t FrameGate::thrownBefore(const Track& next, std::uint64_t step, bool newTimeline) const {
  if (thrown_ == 0 || !current_) return 0;
  const std::int64_t pace = longestMean(*current_);
  if (pace <= 0) return thrown_;
  const std::int64_t elapsed_ns =
      newTimeline || next.distrust > 0 ? next.host_ns - current_->host_ns : elapsed(*current_, next);
  const std::int64_t room = (elapsed_ns + pace / 2) / pace - static_cast<std::int64_t>(step);
  return room > 0 ? std::min(thrown_, static_cast<std::uint64_t>(room)) : 0;
}

Judgement FrameGate::accept(const Track& next, std::uint64_t step, bool newTimeline, bool jumped) {
  Judgement judgement;
  judgement.verdict = Verdict::kNew;
  judgement.timed = next.distrust == 0;
  judgement.step = step;
  if (step > 1) {
    judgement.missing = step - 1;
    for (std::size_t d = 1; d < std::min<std::uint64_t>(step, arrived_.size()); ++d)
      judgement.missing -= arrived_.test(d) ? 1 : 0;
    judgement.missing -= std::min(judgement.missing, arrivedUnnamed_);
  }
  const std::uint64_t thrown = thrownBefore(next, step, newTimeline);
  judgement.doubted = std::exchange(duplicated_, false);
  judgement.missing += thrown;
  frameNumber_ += step + thrown;
  judgement.frameNumber = frameNumber_;
  judgement.newTimeline = newTimeline;
  judgement.discontinuity = current_ && (jumped || step > 1 || thrown > 0);
  const std::int64_t pace = current_ ? current_->pace_ns : 0;
  current_ = next;
  heard_ns_ = next.host_ns;
  heldBack_ = 0;
  if (thrown > 0) current_->pace_ns = pace;  // more than `step` frames were taken since
  candidate_.reset();
  reopened_ = false;
  arrived_.reset();
  arrivedUnnamed_ = 0;
  thrown_ = 0;
  return judgement;
}

Judgement FrameGate::judge(const Arrival& arrival) {
  Judgement judgement = judgeOrder(arrival);
  if (judgement.verdict != Verdict::kNew) return judgement;
  const bool equals = arrival.whole != 0 && (whole_ == 0 || whole_ == arrival.whole);
  equal_ = equals ? std::min(equal_ + 1, kRepeating) : 1;
  whole_ = arrival.whole;
  judgement.discontinuity |= std::exchange(isRepeated_, equal_ == kRepeating);
  if (isRepeated_) judgement.verdict = Verdict::kRepeated;
  return judgement;
}

Judgement FrameGate::judgeOrder(const Arrival& arrival) {
  thrown_ += arrival.thrown;
  duplicated_ |= arrival.duplicated;
  const auto refuse = [&](Verdict verdict) {
    markArrived(arrival);
    Judgement judgement;
    judgement.verdict = verdict;
    return judgement;
  };
  const auto refuseDamaged = [&](Verdict verdict) {
    if (!reopened_ && current_ && isNext(*current_, arrival)) {
      if (!candidate_ || !isNext(*candidate_, arrival)) {
        heard_ns_ = arrival.host_ns;
        heldBack_ = 0;
      }
    } else if (arrival.complete) {
      ++heldBack_;  // the id of one that is not whole may be an older frame's
    }
    return refuse(verdict);
  };
  if (!arrival.complete) return refuseDamaged(Verdict::kIncomplete);
  if (arrival.shape.width != agreed_.width || arrival.shape.height != agreed_.height ||
      arrival.shape.size != agreed_.size)
    return refuseDamaged(Verdict::kWrongSize);
  if (arrival.shape.format != agreed_.format) return refuseDamaged(Verdict::kWrongFormat);
  if (arrival.id == 0 && !options_.zeroIsAnId) return refuse(Verdict::kStale);

  if (seenBefore(arrival)) return refuse(Verdict::kStale);
  history_[historyCount_++ % history_.size()] = {arrival.id, arrival.content, arrival.device_ns};

  if (!current_) return accept(begin(arrival), 1, true, false);
  const Fit fit = reopened_ ? Fit::kNone : follows(*current_, arrival);
  if (fit != Fit::kNone) return acceptNext(arrival, fit);
  const Fit further = candidate_ ? follows(*candidate_, arrival) : Fit::kNone;
  if (further == Fit::kNone)
    candidate_ = begin(arrival);
  else
    extend(*candidate_, arrival, further);
  ++heldBack_;

  // Frames reach the host less evenly than the camera takes them, hence one less than the candidate has. A current
  // track that is shorter than a candidate proves nothing.
  const bool fellSilent =
      current_->length < kAgreeing || arrival.host_ns - heard_ns_ >= (kAgreeing - 1) * frameTime(*current_);
  if (reopened_ || (candidate_->length >= kAgreeing && fellSilent)) return acceptCandidate(arrival);
  const bool older = advance(current_->id, arrival.id) <= 0 ||
                     (current_->distrust == 0 && difference(arrival.device_ns, current_->device_ns) <= 0);
  return refuse(older ? Verdict::kStale : Verdict::kImplausible);
}

/// Accepts a frame that continues the current track.
Judgement FrameGate::acceptNext(const Arrival& arrival, Fit fit) {
  Track next = *current_;
  extend(next, arrival, fit);
  const bool believed = current_->distrust == 0;
  const std::int64_t step = advance(current_->id, arrival.id);
  // A clock that stands still has not jumped. A counter that started anew may have come back to where it was, and its
  // own pictures were held back until now.
  const bool cameBack =
      heldBack_ >= kAgreeing && arrival.host_ns - current_->host_ns > (step + kAgreeing) * frameTime(*current_);
  const bool jumped = cameBack || (believed && fit == Fit::kByTheHosts && arrival.device_ns != current_->device_ns);
  return accept(next, static_cast<std::uint64_t>(step), believed != (next.distrust == 0), jumped);
}

/// Replaces the current track by the candidate, which ends with this frame.
Judgement FrameGate::acceptCandidate(const Arrival& arrival) {
  // The ids may still be those of the same count: after a pause of the host, or of the cable. Twice the time: frames
  // reach the host less evenly than the camera takes them.
  const std::int64_t step = advance(current_->id, arrival.id);
  std::int64_t period = current_->period_ns > 0 ? current_->period_ns : candidate_->period_ns;
  if (current_->distrust > 0) period = current_->pace_ns;
  const std::int64_t twice = 2 * (arrival.host_ns - current_->host_ns);
  const bool counts = step > 0 && static_cast<std::uint64_t>(step) <= largestStep(period, twice);
  return accept(*candidate_, counts ? static_cast<std::uint64_t>(step) : 1, true, true);
}

void count(const Judgement& judgement, Ledger& ledger) {
  ledger.received.add();
  ledger.missing.add(judgement.missing);  // 0 of those that are refused
  switch (judgement.verdict) {
  case Verdict::kNew:
    if (judgement.doubted) ledger.doubted.add();
    break;
  case Verdict::kIncomplete:
    ledger.incomplete.add();
    break;
  case Verdict::kWrongSize:
    ledger.wrongSize.add();
    break;
  case Verdict::kWrongFormat:
    ledger.wrongFormat.add();
    break;
  case Verdict::kStale:
    ledger.stale.add();
    break;
  case Verdict::kImplausible:
    ledger.implausible.add();
    break;
  case Verdict::kRepeated:
    ledger.repeated.add();
    break;
  }
}

}  // namespace tractiond::capture
