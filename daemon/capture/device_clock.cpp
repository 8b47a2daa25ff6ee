// Strategy. Frames are delayed on their way, never hastened: of each second the frame with the shortest delay is kept,
// the line through the last sixteen of these gives the drift, and the line is lowered until no frame lies below it.
#include "daemon/capture/device_clock.h"

#include <algorithm>
#include <cmath>

namespace tractiond::capture {
namespace {

/// Before a drift can be told from the jitter.
constexpr std::size_t kWindowsForDrift = 4;
/// GigE Vision stamps are often of a microsecond.
constexpr double kResolution_ns = 1000;

}  // namespace

void DeviceClock::fit() {
  const std::size_t closed = points_ - 1;
  const std::size_t n = std::min(closed, kWindows);
  double meanDevice = 0, meanDelay = 0;
  for (std::size_t i = 0; i < n; ++i) {
    meanDevice += lowest_[i].device_ns / static_cast<double>(n);
    meanDelay += lowest_[i].delay_ns / static_cast<double>(n);
  }
  double product = 0, square = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double x = lowest_[i].device_ns - meanDevice;
    product += x * (lowest_[i].delay_ns - meanDelay);
    square += x * x;
  }
  drift_ = n < kWindowsForDrift || square <= 0
               ? 0
               : std::clamp(product / square, -options_.largestDrift, options_.largestDrift);
  offset_ns_ = open_.delay_ns - drift_ * open_.device_ns;
  for (std::size_t i = 0; i < n; ++i)
    offset_ns_ = std::min(offset_ns_, lowest_[i].delay_ns - drift_ * lowest_[i].device_ns);
  scatter_ns_ = 0;
  for (std::size_t i = 0; i < n; ++i) scatter_ns_ = std::max(scatter_ns_, excess(lowest_[i]));
}

DeviceClock::Moment DeviceClock::add(std::int64_t device_ns, std::int64_t host_ns) {
  if (points_ == 0) {
    deviceOrigin_ns_ = device_ns;
    hostOrigin_ns_ = host_ns;
    open_ = {};
    openUntil_ns_ = static_cast<double>(options_.window_ns);
    points_ = 1;
    fit();
  }
  const auto device = static_cast<double>(device_ns - deviceOrigin_ns_);
  const Point point{device, static_cast<double>(host_ns - hostOrigin_ns_) - device};
  if (device >= openUntil_ns_) {
    lowest_[(points_ - 1) % kWindows] = open_;
    ++points_;
    open_ = point;
    openUntil_ns_ = device + static_cast<double>(options_.window_ns);
    fit();
  }
  if (point.delay_ns < open_.delay_ns) open_ = point;
  const double below = -excess(point);
  if (below > 0) {
    offset_ns_ -= below;
    scatter_ns_ += below;
  }

  const double mapped = device + offset_ns_ + drift_ * device;
  Moment moment;
  moment.captured_ns =
      std::clamp<std::int64_t>(hostOrigin_ns_ + std::llround(mapped), std::min(lastCaptured_ns_, host_ns), host_ns);
  lastCaptured_ns_ = moment.captured_ns;
  // Until the drift is known it may be the largest.
  const double unknownDrift = points_ - 1 < kWindowsForDrift ? options_.largestDrift * device : 0;
  moment.error_ns = std::llround(scatter_ns_ + unknownDrift + kResolution_ns);
  return moment;
}

}  // namespace tractiond::capture
