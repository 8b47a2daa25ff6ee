#include "tests/simulation/camera.h"

#include <algorithm>
#include <cstring>

namespace tractiond::simulation {
namespace {

constexpr std::int64_t kPeriod_ns = 16'666'667;
constexpr std::int64_t kUnderWay_ns = 9 * kMs;  // exposure, read-out and transport
constexpr std::uint64_t kIds = 65'535;          // 16 bit, never 0

}  // namespace

Camera::Camera(const Gel& gel, const Ongoing& ongoing, Chance& chance)
    : gel_(gel)
    , ongoing_(ongoing)
    , chance_(chance)
    , shape_{gel.sensor.camera.width, gel.sensor.camera.height, sizeof(Picture::bytes), 1}
    , nextPicture_ns_(now() + kPeriod_ns) {}

void Camera::connect(std::int64_t streamsFrom_ns, std::int64_t from_ns) {
  hasOtherPictures_ = false;
  streamsFrom_ns_ = streamsFrom_ns;
  connectedFrom_ns_ = from_ns;
}

void Camera::disconnect() {
  streamsFrom_ns_ = connectedFrom_ns_ = kNever;
  queue_.clear();
}

void Camera::apply(const Happening& one) {
  switch (one.event) {
  case Event::kOtherPictures:
    hasOtherPictures_ = true;
    break;
  case Event::kGone:
    goneSince_ns_ = now();
    id_ = 0;
    break;
  case Event::kIdsRestart:
    id_ = 0;
    break;
  case Event::kIdsJump:
    id_ = (id_ + static_cast<std::uint64_t>(one.amount)) % kIds;
    break;
  case Event::kClockStep:
    clockAhead_ns_ += one.amount * kMs;
    break;
  default:
    break;
  }
}

void Camera::turn() {
  if (nextPicture_ns_ <= now()) takePicture();
}

OnItsWay Camera::picture() {
  OnItsWay one;
  one.picture.number = ++pictures_;
  one.picture.noise = chance_.below(gel_.noises.size());
  std::memcpy(one.picture.bytes.data(), &pictures_, sizeof pictures_);
  one.arrival.complete = true;
  one.arrival.shape = shape_;
  one.picture.taken = taken_;
  return one;
}

void Camera::takePicture() {
  nextPicture_ns_ += kPeriod_ns;
  if (now() >= streamsFrom_ns_) id_ = id_ == kIds ? 1 : id_ + 1;
  if (ongoing_.lasts(Event::kGone)) id_ = 0;
  ++taken_;
  OnItsWay one = picture();
  if (hasOtherPictures_) ++one.arrival.shape.width;
  if (ongoing_.lasts(Event::kTouch)) one.picture.force_N = 1e-3 * static_cast<double>(ongoing_.amountOf(Event::kTouch));
  one.picture.isFew = ongoing_.lasts(Event::kFewMarkers);
  one.at_ns = now() + kUnderWay_ns + chance_.between(0, kMs);
  if (ongoing_.lasts(Event::kLate)) one.at_ns += chance_.between(0, ongoing_.amountOf(Event::kLate) * kMs);
  one.arrival.complete = !ongoing_.hits(Event::kBroken, chance_);
  one.arrival.id = id_;
  one.arrival.device_ns = ongoing_.lasts(Event::kNoClock) ? 0 : now() + clockAhead_ns_;
  if (ongoing_.lasts(Event::kSilence) || ongoing_.lasts(Event::kGone) || ongoing_.hits(Event::kLoss, chance_)) return;
  send(one);
  if (ongoing_.hits(Event::kAgain, chance_) && one.arrival.complete) {
    one.at_ns += chance_.between(1, 400) * kMs;
    send(one);
  }
}

void Camera::send(const OnItsWay& one) {
  if (now() < connectedFrom_ns_) return;
  const auto later = std::ranges::upper_bound(queue_, one.at_ns, std::ranges::less(), &OnItsWay::at_ns);
  queue_.insert(later, one);
  // A starved host has no buffer free, and what comes then is lost.
  const auto here = std::ranges::count_if(queue_, [](const OnItsWay& each) { return each.at_ns <= now(); });
  if (here > kBuffers) queue_.erase(queue_.begin() + kBuffers);
}

OnItsWay Camera::take() {
  const OnItsWay one = queue_.front();
  queue_.pop_front();
  return one;
}

bool Camera::comesTwice(const OnItsWay& taken) const {
  return std::ranges::any_of(queue_, [&](const OnItsWay& each) {
    return each.arrival.id == taken.arrival.id && each.at_ns - kFrame_ns < taken.at_ns;
  });
}

std::int64_t Camera::answersAfter_ns() const {
  constexpr std::int64_t kUsual_ns = 1 * kMs;
  if (ongoing_.lasts(Event::kGone)) return kNever;
  return ongoing_.lasts(Event::kSlowAnswers) ? ongoing_.amountOf(Event::kSlowAnswers) * kMs : kUsual_ns;
}

}  // namespace tractiond::simulation
