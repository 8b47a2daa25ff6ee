// Strategy. Of a camera that can be asked what its clock shows a stamp lies between two bounds: clock_fit.h. Of one
// that cannot: frames are delayed on their way, never hastened. Of each second the frame with the shortest delay is
// kept, the line through the last sixteen of these gives the drift, and the line is lowered until no frame lies below
// it.
#include "daemon/capture/device_clock.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numeric>

namespace tractiond::capture {
namespace {

/// The frame with the shortest delay of each window is used.
constexpr std::int64_t kWindow_ns = 1'000'000'000;
/// Camera crystals stay below 100 ppm; NTP slews up to 500 ppm.
constexpr double kLargestDrift = 500e-6;
/// Before a drift can be distinguished from the jitter.
constexpr std::size_t kWindowsForDrift = 4;
/// GigE Vision stamps are often of a microsecond.
constexpr std::int64_t kResolution_ns = 1000;
/// No operating system hands packets on more evenly.
constexpr std::int64_t kHostJitter_ns = 1'000'000;
/// Of the very first frame, of which nothing is known.
constexpr std::int64_t kFirstError_ns = 100'000'000;
/// The time of day is corrected no faster (adjtimex); what is seen of it is added.
constexpr double kSlew = 500e-6;
/// That it is looked at over.
constexpr std::int64_t kSlewWindow_ns = 100'000'000;
/// Two clocks of the host cannot be read at once.
constexpr std::int64_t kReading_ns = 1000;
/// A frame is that late at most, beside four of its periods; else its stamp is not of the clock that was asked.
constexpr std::int64_t kLatest_ns = 1'000'000'000;
/// Before the host's scatter is known; until then a frame may be late by a whole period.
constexpr int kScatterFrames = 32;
/// Of n frames whose delays are spread evenly over a range, the shortest is within so many n-th parts of that range
/// from its lower end, in 99 of 100 cases; of other distributions that are densest there, more often.
constexpr std::int64_t kParts = 5;

}  // namespace

void DeviceClock::fit() {
  const std::size_t n = std::min(points_ - 1, kWindows);
  double meanHost = 0, meanLead = 0;
  for (std::size_t i = 0; i < n; ++i) {
    meanHost += lowest_[i].host_ns / static_cast<double>(n);
    meanLead += lowest_[i].lead_ns / static_cast<double>(n);
  }
  double product = 0, square = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double x = lowest_[i].host_ns - meanHost;
    product += x * (lowest_[i].lead_ns - meanLead);
    square += x * x;
  }
  drift_ = n < kWindowsForDrift ? 0 : std::clamp(product / square, -kLargestDrift, kLargestDrift);
  offset_ns_ = 0;
  double least = delay(open_), most = 0;
  for (std::size_t i = 0; i < n; ++i) {
    least = std::min(least, delay(lowest_[i]));
    most = i == 0 ? delay(lowest_[i]) : std::max(most, delay(lowest_[i]));
  }
  offset_ns_ = least;
  scatter_ns_ = n == 0 ? 0 : most - least;
}

void DeviceClock::learnResolution(std::int64_t device_ns, std::uint64_t step) {
  const std::int64_t elapsed = device_ns - lastDevice_ns_;
  lastDevice_ns_ = device_ns;
  if (points_ == 0 || elapsed <= 0 || step == 0 || step > 1000) return;
  if (period_ns_ == 0 && step == 1) period_ns_ = elapsed;
  const std::int64_t uneven = elapsed - period_ns_ * static_cast<std::int64_t>(step);
  if (period_ns_ > 0 && uneven != 0 && resolution_ns_ != 1) resolution_ns_ = std::gcd(resolution_ns_, std::abs(uneven));
}

DeviceClock::Moment DeviceClock::add(std::int64_t device_ns, std::int64_t host_ns, std::uint64_t step) {
  learnResolution(device_ns, step);
  if (points_ == 0) {
    deviceOrigin_ns_ = device_ns;
    hostOrigin_ns_ = host_ns;
    open_ = {};
    openUntil_ns_ = static_cast<double>(kWindow_ns);
    points_ = 1;
    fit();
  }
  const auto host = static_cast<double>(host_ns - hostOrigin_ns_);
  const auto device = static_cast<double>(device_ns - deviceOrigin_ns_);
  const Point point{host, host - device};
  if (host >= openUntil_ns_) {
    lowest_[(points_ - 1) % kWindows] = open_;
    ++points_;
    open_ = point;
    openUntil_ns_ = host + static_cast<double>(kWindow_ns);
    fit();
  }
  if (delay(point) < delay(open_)) open_ = point;
  const double below = -delay(point);
  if (below > 0) {
    offset_ns_ -= below;
    scatter_ns_ += below;
  }

  Moment moment;
  moment.captured_ns = hostOrigin_ns_ + std::llround(device + line(host));
  // Until the drift is known it may be the largest. Afterwards the line runs on beyond the points that it was laid
  // through, by less than their own length: twice their scatter.
  moment.error_ns =
      std::llround(points_ - 1 < kWindowsForDrift ? scatter_ns_ + kLargestDrift * host : 2 * scatter_ns_) +
      std::max(kResolution_ns, resolution_ns_);
  return moment;
}

std::int64_t CaptureClock::hostError(const Arrival& arrival, std::uint64_t step, bool awaited) {
  const std::int64_t elapsed = lastHost_ns_ == 0 ? 0 : arrival.host_ns - lastHost_ns_;
  lastHost_ns_ = arrival.host_ns;
  queued_ns_ = awaited ? 0 : queued_ns_ + elapsed;
  if (elapsed > 0) {
    const std::int64_t pace = elapsed / static_cast<std::int64_t>(std::max<std::uint64_t>(step, 1));
    pace_ns_ = pace_ns_ == 0 ? pace : pace_ns_ + (pace - pace_ns_) / 16;
    scatter_ns_ = std::max(scatter_ns_ - scatter_ns_ / 64, std::abs(pace - pace_ns_));
  }
  frames_ = std::min(frames_ + 1, kScatterFrames);
  if (pace_ns_ == 0) return kFirstError_ns;
  return kHostJitter_ns + spread() + queued_ns_;
}

/// How unevenly frames arrive.
std::int64_t CaptureClock::spread() const {
  if (pace_ns_ == 0) return kFirstError_ns;
  return frames_ < kScatterFrames ? std::max(scatter_ns_, pace_ns_) : scatter_ns_;
}

/// The device clock knows the shortest delay that it has seen, which comes down to the shortest that there is with the
/// number of frames. Counts one more of these.
std::int64_t CaptureClock::excess() {
  const std::int64_t range_ns = kHostJitter_ns + spread();
  const std::int64_t now_ns = std::min(range_ns, kParts * range_ns / ++mapped_);
  excess_ns_ = mapped_ == 1 ? now_ns : std::min(excess_ns_, now_ns);
  return excess_ns_;
}

/// CLOCK_MONOTONIC's, on the clock that the camera's is compared with.
void CaptureClock::learnRate(const Arrival& arrival) {
  if (arrival.raw_ns - latter_.raw_ns > kSlewWindow_ns) {
    former_ = latter_.raw_ns == 0 ? HostMoment{arrival.host_ns, arrival.raw_ns} : latter_;
    latter_ = {arrival.host_ns, arrival.raw_ns};
  }
  const auto elapsed_ns = static_cast<double>(arrival.raw_ns - former_.raw_ns);
  constexpr auto kEnough = static_cast<double>(kSlewWindow_ns) / 2;
  if (elapsed_ns > kEnough) rate_ = static_cast<double>(arrival.host_ns - former_.monotonic_ns) / elapsed_ns - 1;
}

/// A moment before the arrival, from CLOCK_MONOTONIC_RAW to CLOCK_MONOTONIC.
DeviceClock::Moment CaptureClock::corrected(const DeviceClock::Moment& moment, const Arrival& arrival) const {
  const auto age_ns = static_cast<double>(arrival.raw_ns - moment.captured_ns);
  DeviceClock::Moment corrected = moment;
  corrected.captured_ns = arrival.host_ns - std::llround(age_ns * (1 + rate_));
  corrected.error_ns += std::llround(age_ns * (std::abs(rate_) + kSlew)) + kReading_ns;
  return corrected;
}

std::optional<DeviceClock::Moment> CaptureClock::fromBothSides(const Arrival& arrival) const {
  const auto span = fit_.at(arrival.device_ns, device_.resolution());
  if (!span || span->earliest_ns > arrival.raw_ns) return std::nullopt;
  const std::int64_t latest_ns = std::min(span->latest_ns, arrival.raw_ns);
  if (arrival.raw_ns - latest_ns > kLatest_ns + 4 * pace_ns_) return std::nullopt;
  DeviceClock::Moment moment;
  moment.bound = CaptureBound::kBoth;
  moment.error_ns = (latest_ns - span->earliest_ns + 1) / 2;
  moment.captured_ns = span->earliest_ns + moment.error_ns;
  return moment;
}

DeviceClock::Moment CaptureClock::add(Arrival arrival, const Judgement& judgement, bool awaited) {
  if (arrival.raw_ns == 0) arrival.raw_ns = arrival.host_ns;
  DeviceClock::Moment moment{arrival.host_ns, hostError(arrival, judgement.step, awaited)};
  learnRate(arrival);
  if (judgement.newTimeline) {
    device_ = {};  // the clock was set, or the camera is another one
    mapped_ = 0;
  }
  if (judgement.timed) {
    DeviceClock::Moment mapped = corrected(device_.add(arrival.device_ns, arrival.raw_ns, judgement.step), arrival);
    mapped.error_ns += excess();
    if (mapped.error_ns <= moment.error_ns) moment = mapped;
    if (const auto known = fromBothSides(arrival)) moment = corrected(*known, arrival);
  }
  const std::int64_t captured_ns =
      std::clamp(moment.captured_ns, std::min(lastCaptured_ns_, arrival.host_ns), arrival.host_ns);
  moment.error_ns += std::abs(captured_ns - moment.captured_ns);
  moment.captured_ns = captured_ns;
  lastCaptured_ns_ = moment.captured_ns;
  return moment;
}

}  // namespace tractiond::capture
