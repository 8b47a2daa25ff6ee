#include "tests/simulation/zeros.h"

#include <fmt/format.h>

#include <utility>

namespace tractiond::simulation {

Zeros::Zeros(const Gel& gel, Disk& disk, Journal& journal)
    : gel_(gel)
    , disk_(disk)
    , journal_(journal) {}

std::future<tl::expected<void, Error>> Zeros::keep(const RestPose& pose, const RestPose* before) {
  overwritten_ = lastKept_;
  lastKept_ = pose.id;
  isKeptHeeded_ = false;
  Keeping& one = keeping_.emplace_back();
  disk_.beginWork();
  one.outcome = track::saveZeros(kState, pose, before, owner());
  one.at_ns = disk_.endWork();
  journal_.say(fmt::format("zero {} is being written, for {} ms{}", nameOf(pose.id), (one.at_ns - now()) / kMs,
                           one.outcome ? "" : ", and cannot be"));
  return one.done.get_future();
}

void Zeros::turn() {
  for (; !keeping_.empty() && keeping_.front().at_ns <= now(); keeping_.pop_front()) {
    if (keeping_.front().outcome) wasKept_ = true;
    keeping_.front().done.set_value(keeping_.front().outcome);
  }
}

void Zeros::heedTurn() {
  if (keeping_.empty()) isKeptHeeded_ = true;
}

tl::expected<std::optional<RestPose>, Error> Zeros::load() const {
  return track::loadRestPose(track::restPosePath(kState), gel_.sensor, PixelFormat::kRgb8, kCamera);
}

void Zeros::describe(const RestPose& pose) {
  const bool isOther = inForce_ && *inForce_ != pose.id;
  if (isOther) {
    Disk left;  // if all were lost that can be
    const auto content = disk_.synchronised(track::restPosePath(kState));
    if (content) left.put(track::restPosePath(kState), *content);
    Disk* const real = std::exchange(disk(), &left);
    const auto kept = load();
    disk() = real;
    journal_.law(kept && *kept && (*kept)->id == pose.id, "a zero in force is on the disk",
                 fmt::format("zero {} is in force", nameOf(pose.id)));
    journal_.law(pose.requested || hasUndone_, "no zero comes into force that nobody asked for", nameOf(pose.id));
    previous_ = inForce_;
  }
  if (!inForce_ || isOther) {
    describedAt_ns_ = now();
    journal_.say(fmt::format("zero {} is in force", nameOf(pose.id)));
  }
  inForce_ = pose.id;
}

Zeros::Left Zeros::restore() {
  const auto zero = load();
  journal_.law(zero.has_value(), "a zero survives the loss of power", zero ? "" : zero.error().message());
  if (hasLived_) check(*zero);
  hasLived_ = true;
  const auto before = track::loadEarlierZero(kState, *zero, owner());
  journal_.law(before.has_value(), "the zero before survives the loss of power",
               before ? "" : before.error().message());
  return {*zero, *before};
}

void Zeros::check(const std::optional<RestPose>& restored) {
  const std::string is = restored ? nameOf(restored->id) : "none";
  journal_.say("restored zero: " + is);
  const bool isWriting = !isKeptHeeded_;
  const bool fits = restored ? (inForce_ && restored->id == *inForce_) ||
                                   (isWriting && (restored->id == lastKept_ || restored->id == overwritten_))
                             : !wasKept_;
  journal_.law(fits, "after a loss of power the state is that of before or after",
               fmt::format("zero {} is restored, {} was in force", is, inForce_ ? nameOf(*inForce_) : "none"));
  // Another one than that in force: which it is the one before of is not followed here.
  if (!restored || !inForce_ || restored->id != *inForce_) previous_.reset();
  inForce_.reset();
  isKeptHeeded_ = true;
  if (restored) lastKept_ = overwritten_ = restored->id;
}

}  // namespace tractiond::simulation
