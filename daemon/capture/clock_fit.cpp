#include "daemon/capture/clock_fit.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numeric>

namespace tractiond::capture {
namespace {

constexpr double kReach_ns = 30e9;
/// Assumed resolution of a clock, until it is known.
constexpr std::int64_t kCoarse_ns = 1'000'000;
constexpr int kDifferences = 2;
/// 500 ppm of the device's crystal, and as much of the host's.
constexpr double kLargestRate = 1000e-6;
/// Change of the rate per nanosecond: a crystal that warms by a kelvin per second.
constexpr double kWander = 1e-6 * 1e-9;

/// a - b as the two's complement says: the camera's times may be anything.
std::int64_t difference(std::int64_t a, std::int64_t b) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b));
}

}  // namespace

void ClockFit::learnResolution(std::int64_t elapsed_ns) {
  resolution_ns_ = std::gcd(resolution_ns_, elapsed_ns);
  differences_ = std::min(differences_ + 1, kDifferences);
}

void ClockFit::add(const ClockReading& reading) {
  if (count_ > 0) {
    const std::int64_t elapsed_ns = difference(reading.device_ns, ring_[(next_ + kMost - 1) % kMost].device_ns);
    const std::optional<Span> span = elapsed_ns > 0 ? expected(reading.device_ns, 0) : std::nullopt;
    if (!span || span->earliest_ns > reading.after_ns || span->latest_ns < reading.before_ns)
      count_ = 0;
    else
      learnResolution(elapsed_ns);
  }
  ring_[next_] = reading;
  next_ = (next_ + 1) % kMost;
  count_ = std::min(count_ + 1, kMost);
  while (!fit()) count_ = (count_ + 1) / 2;
}

/// False: the readings contradict each other.
bool ClockFit::fit() {
  const ClockReading& newest = ring_[(next_ + kMost - 1) % kMost];
  const auto resolution =
      static_cast<double>(differences_ < kDifferences ? kCoarse_ns : std::min(resolution_ns_, kCoarse_ns));
  for (std::size_t i = 0; i < count_; ++i) {
    const ClockReading& one = ring_[(next_ + kMost - 1 - i) % kMost];
    const auto x = static_cast<double>(difference(one.device_ns, newest.device_ns));
    // It showed this from now on or until now, whichever way it rounds.
    bounds_[i] = {x, static_cast<double>(one.before_ns - newest.before_ns) - x - resolution,
                  static_cast<double>(one.after_ns - newest.before_ns) - x + resolution};
  }
  slowest_ = -kLargestRate;
  fastest_ = kLargestRate;
  for (std::size_t late = 0; late < count_; ++late) {
    for (std::size_t early = late + 1; early < count_; ++early) {
      const Bound &a = bounds_[early], &b = bounds_[late];
      const double way = b.x_ns - a.x_ns;
      const double allowed = kWander * -(a.x_ns + b.x_ns) / 2;
      slowest_ = std::max(slowest_, (b.low_ns - a.high_ns) / way - allowed);
      fastest_ = std::min(fastest_, (b.high_ns - a.low_ns) / way + allowed);
    }
  }
  return slowest_ <= fastest_;
}

std::int64_t ClockFit::span_ns() const {
  if (count_ < 2) return 0;
  return ring_[(next_ + kMost - 1) % kMost].before_ns - ring_[(next_ + kMost - count_) % kMost].before_ns;
}

/// A single reading may be of something that is no clock.
std::optional<ClockFit::Span> ClockFit::at(std::int64_t device_ns, std::int64_t resolution_ns) const {
  return count_ < 2 ? std::nullopt : expected(device_ns, resolution_ns);
}

std::optional<ClockFit::Span> ClockFit::expected(std::int64_t device_ns, std::int64_t resolution_ns) const {
  const ClockReading& newest = ring_[(next_ + kMost - 1) % kMost];
  const auto x = static_cast<double>(difference(device_ns, newest.device_ns));
  if (std::abs(x) > kReach_ns) return std::nullopt;
  const double slowest = std::max(slowest_ - kWander * std::abs(x), -kLargestRate);
  const double fastest = std::min(fastest_ + kWander * std::abs(x), kLargestRate);
  double low = -HUGE_VAL, high = HUGE_VAL;
  for (std::size_t i = 0; i < count_; ++i) {
    const double way = x - bounds_[i].x_ns;
    const double allowed = kWander * way * way / 2;
    low = std::max(low, bounds_[i].low_ns + std::min(slowest * way, fastest * way) - allowed);
    high = std::min(high, bounds_[i].high_ns + std::max(slowest * way, fastest * way) + allowed);
  }
  if (low > high) return std::nullopt;
  const auto shown = static_cast<double>(resolution_ns);
  return Span{newest.before_ns + std::llround(std::floor(x + low - shown)),
              newest.before_ns + std::llround(std::ceil(x + high + shown))};
}

}  // namespace tractiond::capture
