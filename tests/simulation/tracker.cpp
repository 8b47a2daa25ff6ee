#include "tests/simulation/tracker.h"

#include "base/clock.h"

#include <algorithm>
#include <utility>

namespace tractiond::simulation {

using track::ZeroState;

bool Tracker::track(const Picture& picture, MarkerField& field) {
  if (decision_) {
    if (decision_->id != force_.id) restore(*decision_);
    decision_.reset();
  }
  if (state_ == ZeroState::kRequested) {
    state_ = ZeroState::kTaking;
    begin(true);
  } else if (taking_ && takingRequested_ && state_ != ZeroState::kTaking) {
    taking_ = false;
  }
  write(picture, field);
  const bool tracked = hasForce_ && verdict_ == force_.id;
  take(picture);
  return tracked;
}

bool Tracker::cancel() {
  const bool was = state_ == ZeroState::kRequested || state_ == ZeroState::kTaking;
  if (was) state_ = ZeroState::kNone;
  return was;
}

bool Tracker::takeRestPose(RestPose& pose) {
  if (!finished_) return false;
  pose = *std::exchange(finished_, std::nullopt);
  return true;
}

void Tracker::restore(const RestPose& pose) {
  force_ = pose;
  hasForce_ = true;
}

void Tracker::putInForce(const RestPose& pose) {
  decision_ = pose;
  verdict_ = pose.id;
}

void Tracker::setGelFits(const Id& zero) {
  if (zero == force_.id) verdict_ = zero;
}

void Tracker::begin(bool requested) {
  taking_ = true;
  takingRequested_ = requested;
  seen_ = 0;
  first_N_ = -1.0;
  sum_.assign(2 * gel_.places.size(), 0.0);
}

double Tracker::placeOf(std::size_t coordinate, const Picture& picture) const {
  const track::Vector& place = gel_.places[coordinate / 2];
  return (coordinate % 2 == 0 ? place.u : place.v) +
         picture.force_N * gel_.press[static_cast<Eigen::Index>(coordinate)] + gel_.noises[picture.noise][coordinate];
}

void Tracker::take(const Picture& picture) {
  if (!hasForce_ && !taking_ && !picture.isFew) begin(false);
  if (!taking_) return;
  if (picture.isFew || (first_N_ >= 0.0 && picture.force_N != first_N_)) {
    taking_ = false;
    if (takingRequested_) state_ = picture.isFew ? ZeroState::kTooFew : ZeroState::kMoving;
    return;
  }
  first_N_ = picture.force_N;
  for (std::size_t i = 0; i < sum_.size(); ++i) sum_[i] += placeOf(i, picture);
  if (++seen_ < kZeroFrames) return;
  taking_ = false;
  RestPose pose;
  pose.position_px.resize(sum_.size());
  for (std::size_t i = 0; i < sum_.size(); ++i) pose.position_px[i] = static_cast<float>(sum_[i] / seen_);
  pose.amplitude.assign(gel_.places.size(), 50.0F);
  pose.present.assign(gel_.places.size(), 1);
  pose.oddity.assign(gel_.places.size(), 0.0F);
  pose.noise = 1.0F;
  pose.taken_ns = realNow();
  pose.requested = takingRequested_;
  pose.id = track::idOf(pose);
  if (takingRequested_) state_ = ZeroState::kTaken;
  if (!hasForce_) restore(pose);
  finished_ = pose;
  finishedPress_N_ = first_N_;
}

void Tracker::write(const Picture& picture, MarkerField& field) const {
  const std::size_t count = gel_.places.size();
  std::fill(field.valid.begin(), field.valid.end(), std::uint8_t{hasForce_ ? std::uint8_t{1} : std::uint8_t{0}});
  std::fill(field.variance_px2.begin(), field.variance_px2.end(), static_cast<float>(kNoise_px * kNoise_px));
  field.zero = force_.id;
  field.flags = (field.info.doubted ? kDoubtedOrigin : 0U) | (picture.isFew ? kFewMarkers : 0U);
  for (std::size_t i = 0; hasForce_ && i < 2 * count; ++i)
    field.displacement_px[i] = static_cast<float>(placeOf(i, picture) - force_.position_px[i]);
  if (picture.isFew) {
    for (std::size_t i = count / 4; i < count; ++i) {
      field.valid[i] = 0;
      field.variance_px2[i] = field.displacement_px[2 * i] = field.displacement_px[2 * i + 1] = 0.0F;
    }
  }
  field.validCount = static_cast<int>(std::count(field.valid.begin(), field.valid.end(), 1));
}

}  // namespace tractiond::simulation
