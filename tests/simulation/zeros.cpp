#include "tests/simulation/zeros.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace tractiond::simulation {
namespace {

bool areSame(const RestPose& a, const RestPose& b) {
  return a.position_px == b.position_px && a.amplitude == b.amplitude && a.present == b.present && a.noise == b.noise;
}

}  // namespace

Zeros::Zeros(const Gel& gel, Disk& disk, Journal& journal)
    : gel_(gel)
    , disk_(disk)
    , journal_(journal)
    , keeping_(disk) {}

std::future<tl::expected<void, Error>> Zeros::keep(const RestPose& pose, const RestPose* before) {
  journal_.law(std::ranges::find(compared_, pose.id) != compared_.end(), "a zero is judged before it is written",
               nameOf(pose.id));
  unsure_.push_back(pose.id);
  saved_.insert_or_assign(pose.id, pose);
  auto done = keeping_.begin([&] { return control::saveZeros(kState, pose, before, owner()); });
  const auto& one = keeping_.newest();
  journal_.say(fmt::format("zero {} is being written, for {} ms{}", nameOf(pose.id), (one.at_ns - now()) / kMs,
                           one.outcome ? "" : ", and cannot be"));
  return done;
}

void Zeros::turn() {
  keeping_.turn([this](const Kept& kept) {
    hasFailed_ = !kept;
    if (kept) wasKept_ = true;
  });
}

void Zeros::noteTurn() {
  if (keeping_.isIdle() && !hasFailed_) unsure_.clear();
}

std::optional<Id> Zeros::synchronised() const {
  Disk left;
  const auto content = disk_.synchronised(track::restPosePath(kState));
  if (content) left.put(track::restPosePath(kState), *content);
  Disk* const real = std::exchange(disk(), &left);
  const auto kept = load();
  disk() = real;
  return kept && *kept ? std::optional((*kept)->id) : std::nullopt;
}

tl::expected<std::optional<RestPose>, Error> Zeros::load() const {
  return track::loadRestPose(track::restPosePath(kState), gel_.sensor, PixelFormat::kRgb8, kCamera);
}

void Zeros::describe(const RestPose& pose) {
  const bool isOther = inForce_ && *inForce_ != pose.id;
  if (isOther) {
    journal_.law(synchronised() == pose.id, "a zero in force is on the disk",
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
  const auto survives = [this](const auto& loaded) {
    journal_.law(loaded.has_value(), "a zero survives the loss of power",
                 [&] { return loaded ? std::string() : loaded.error().message(); });
  };
  const auto restored = control::restoreZero(kState, owner());
  survives(restored);
  const auto before = control::loadEarlierZero(kState, *restored, owner());
  survives(before);
  hasFailed_ = *restored && synchronised() != (*restored)->id;
  for (const auto* pose : {&*restored, &*before}) {
    if (!*pose) continue;
    const auto saved = saved_.find((*pose)->id);
    journal_.law(saved != saved_.end() && areSame(saved->second, **pose), "a zero is restored as it was saved",
                 [&] { return nameOf((*pose)->id); });
  }
  if (hasLived_) check(*restored);
  hasLived_ = true;
  return {*restored, *before};
}

void Zeros::check(const std::optional<RestPose>& restored) {
  const std::string is = restored ? nameOf(restored->id) : "none";
  journal_.say("restored zero: " + is);
  const bool fits = restored ? restored->id == inForce_ || (!inForce_ && restored->id == restored_) ||
                                   std::ranges::find(unsure_, restored->id) != unsure_.end()
                             : !wasKept_;
  journal_.law(fits, "after a loss of power the state is that of before or after",
               fmt::format("zero {} is restored, {} was in force", is, inForce_ ? nameOf(*inForce_) : "none"));
  if (!hasFailed_) unsure_.clear();
  if (hasFailed_ && inForce_) unsure_.push_back(*inForce_);
  // Which zero is the one before is not followed here for another than that in force, nor for an older file of the
  // same.
  if (!restored || !inForce_ || restored->id != *inForce_) previous_.reset();
  inForce_.reset();
  restored_ = restored ? std::optional(restored->id) : std::nullopt;
}

}  // namespace tractiond::simulation
