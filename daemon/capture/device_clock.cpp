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
constexpr std::int64_t kResolution_ns = 1000;

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
  drift_ = n < kWindowsForDrift ? 0 : std::clamp(product / square, -options_.largestDrift, options_.largestDrift);
  offset_ns_ = 0;
  double least = delay(open_), most = 0;
  for (std::size_t i = 0; i < n; ++i) {
    least = std::min(least, delay(lowest_[i]));
    most = i == 0 ? delay(lowest_[i]) : std::max(most, delay(lowest_[i]));
  }
  offset_ns_ = least;
  scatter_ns_ = n == 0 ? 0 : most - least;
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
  const auto host = static_cast<double>(host_ns - hostOrigin_ns_);
  const auto device = static_cast<double>(device_ns - deviceOrigin_ns_);
  const Point point{host, host - device};
  if (host >= openUntil_ns_) {
    lowest_[(points_ - 1) % kWindows] = open_;
    ++points_;
    open_ = point;
    openUntil_ns_ = host + static_cast<double>(options_.window_ns);
    fit();
  }
  if (delay(point) < delay(open_)) open_ = point;
  const double below = -delay(point);
  if (below > 0) {
    offset_ns_ -= below;
    scatter_ns_ += below;
  }

  Moment moment;
  const std::int64_t mapped_ns = hostOrigin_ns_ + std::llround(device + line(host));
  moment.captured_ns = std::clamp(mapped_ns, std::min(lastCaptured_ns_, host_ns), host_ns);
  lastCaptured_ns_ = moment.captured_ns;
  // Until the drift is known it may be the largest. Afterwards the line runs on beyond the points that it was laid
  // through, by less than their own length: twice their scatter.
  moment.error_ns =
      std::llround(points_ - 1 < kWindowsForDrift ? scatter_ns_ + options_.largestDrift * host : 2 * scatter_ns_) +
      kResolution_ns;
  return moment;
}

}  // namespace tractiond::capture
