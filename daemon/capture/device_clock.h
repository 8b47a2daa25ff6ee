// Maps the camera's time stamps to CLOCK_MONOTONIC: estimates when each picture was taken.
#pragma once

#include "base/clock.h"
#include "daemon/capture/clock_fit.h"
#include "daemon/capture/frame_gate.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace tractiond::capture {

/// Maps time stamps from arrivals alone. Thread-bound. Allocates nothing.
///
/// Fits host - device = offset + drift (host - origin) + delay, delay >= 0: a line below all points. One-way stamps
/// cannot show the shortest delay itself (exposure, read-out and transport of the fastest frame): the mapped time is
/// late by it, and has no lower bound.
class DeviceClock {
 public:
  struct Moment {
    /// Estimate on the clock of the arrivals; of CaptureClock not after the arrival, nor before that of the frame
    /// before.
    std::int64_t captured_ns = 0;
    /// Half width of the uncertainty. kBoth: both sides are bounds. kLatest: the upper side is a bound; the lower one
    /// does not include the shortest delay.
    std::int64_t error_ns = 0;
    CaptureBound bound = CaptureBound::kLatest;
  };

  /// Adds a frame and returns when it was taken, with the bound kLatest. Must be called for every new frame in turn.
  /// \param device_ns its time stamp, any value
  /// \param host_ns its arrival, which never falls
  /// \param step increase of its id since the frame before
  Moment add(std::int64_t device_ns, std::int64_t host_ns, std::uint64_t step = 1);

  /// Returns the resolution of the stamps [ns]: their differences from an even pace are multiples of it; 0: not known.
  std::int64_t resolution() const { return resolution_ns_; }
  /// Returns the seconds that the host's clock gains on the camera's per second; 0 until four windows show it.
  double drift() const { return drift_; }

 private:
  struct Point {
    double host_ns = 0, lead_ns = 0;  ///< relative to the origin; lead: host - device
  };
  static constexpr std::size_t kWindows = 16;

  void fit();
  void learnResolution(std::int64_t device_ns, std::uint64_t step);
  double line(double host_ns) const { return offset_ns_ + drift_ * host_ns; }
  double delay(const Point& point) const { return point.lead_ns - line(point.host_ns); }

  std::array<Point, kWindows> lowest_{};  ///< of the closed windows, a ring
  std::size_t points_ = 0;                ///< closed windows since the restart, plus one for the open one
  Point open_;                            ///< lowest of the window that is filling
  double openUntil_ns_ = 0;
  std::int64_t deviceOrigin_ns_ = 0, hostOrigin_ns_ = 0;
  double offset_ns_ = 0, drift_ = 0, scatter_ns_ = 0;
  std::int64_t lastDevice_ns_ = 0, period_ns_ = 0;
  std::int64_t resolution_ns_ = 0;
};

/// Estimates when a frame was taken, by the first of these that is possible:
/// - by the camera's time stamp with bounds on both sides (ClockFit), if Judgement::timed and the clock can be read
/// - by the camera's time stamp with an upper bound (DeviceClock), if Judgement::timed and not less certain than the
///   arrival
/// - by the arrival.
/// Thread-bound. Allocates nothing.
class CaptureClock {
 public:
  /// Sets the newest readings of the camera's clock, on CLOCK_MONOTONIC_RAW, in place of those before. Without readings
  /// (a default ClockFit) the clock is not used as one that can be read.
  void learn(const ClockFit& fit) { fit_ = fit; }

  /// Adds a frame and returns when it was taken, on CLOCK_MONOTONIC. Must be called for every new frame in turn.
  /// \param judgement with kNew
  /// \param awaited the frame came while pop() waited: nothing was queued before it
  DeviceClock::Moment add(Arrival arrival, const Judgement& judgement, bool awaited);

 private:
  std::int64_t hostError(const Arrival& arrival, std::uint64_t step, bool awaited);
  DeviceClock::Moment corrected(const DeviceClock::Moment& moment, const Arrival& arrival) const;
  std::optional<DeviceClock::Moment> fromBothSides(const Arrival& arrival) const;
  void learnRate(const Arrival& arrival);
  std::int64_t spread() const;
  std::int64_t excess();

  DeviceClock device_;
  ClockFit fit_;
  HostMoment former_, latter_;  ///< arrivals, some tenths of a second ago
  double rate_ = 0;             ///< seconds that CLOCK_MONOTONIC gained since then per second of CLOCK_MONOTONIC_RAW
  std::int64_t lastHost_ns_ = 0, lastCaptured_ns_ = INT64_MIN;
  std::int64_t pace_ns_ = 0;     ///< mean time between two ids; 0: not known
  std::int64_t scatter_ns_ = 0;  ///< largest difference from it, slowly forgotten
  std::int64_t queued_ns_ = 0;   ///< how long a frame may have waited before it was popped
  int frames_ = 0;               ///< number that the scatter was measured over, up to a sufficient one
  std::int64_t mapped_ = 0;      ///< frames since the device clock's start
  std::int64_t excess_ns_ = 0;   ///< by which the shortest delay of these may exceed the shortest possible one
};

}  // namespace tractiond::capture
