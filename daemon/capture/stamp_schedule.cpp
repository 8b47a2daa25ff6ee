#include "daemon/capture/stamp_schedule.h"

#include <algorithm>
#include <cstdlib>

namespace tractiond::capture {
namespace {

constexpr int kMostFrames = 64;
/// The error of the pace grows with the frames that were lost.
constexpr std::int64_t kMostSteps = 4;
/// After a longer pause the camera counts from another moment on.
constexpr std::int64_t kPause = 4;
/// Sooner by less may be rounding, or a sensor that is read out a little earlier.
constexpr std::int64_t kLeast_ns = 1'000'000;

/// a - b as the two's complement says; times from outside may be anything.
std::int64_t difference(std::int64_t a, std::int64_t b) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b));
}

}  // namespace

void StampSchedule::restart(std::int64_t device_ns) {
  *this = {};
  due_ns_ = last_ns_ = device_ns;
  frames_ = 1;
}

/// Returns by how much a stamp is later than the schedule [ns]. \param step at most kMostSteps
std::int64_t StampSchedule::ahead(std::int64_t device_ns, std::int64_t step) const {
  return difference(difference(device_ns, due_ns_), step * pace_ns_);
}

bool StampSchedule::isEarly(std::int64_t device_ns, std::int64_t step) const {
  return isEven() && step <= kMostSteps && ahead(device_ns, step) < -std::max(kLeast_ns, kTimes * uneven_ns_);
}

void StampSchedule::add(std::int64_t device_ns, std::int64_t step) {
  constexpr std::int64_t kLongestPace_ns = 1'000'000'000'000, kSlowly = 16;
  if (frames_ == 0) return restart(device_ns);
  const std::int64_t pace_ns =
      std::clamp<std::int64_t>(difference(device_ns, last_ns_) / step, 0, kLongestPace_ns);  // no product overflows
  last_ns_ = device_ns;
  if (frames_ == 1) pace_ns_ = pace_ns;
  const std::int64_t most_ns = quarter();
  const auto bounded = [most_ns](std::int64_t late_ns) { return std::clamp(late_ns, -most_ns, most_ns); };
  if (step <= kMostSteps && frames_ > 1) {
    // A single late stamp must move neither the schedule nor the pace by much.
    const std::int64_t late_ns = ahead(device_ns, step);
    uneven_ns_ += (std::abs(bounded(late_ns)) - uneven_ns_) / kSlowly;
    const bool isPause = late_ns > kPause * pace_ns_;
    due_ns_ = late_ns < 0 || isPause ? device_ns : difference(device_ns, late_ns - bounded(late_ns) / kSlowly);
  } else {
    due_ns_ = device_ns;
  }
  pace_ns_ += bounded(pace_ns - pace_ns_) / frames_;
  frames_ = std::min(frames_ + 1, kMostFrames);
}

}  // namespace tractiond::capture
