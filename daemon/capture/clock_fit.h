// Maps a clock that can be read to the host's clock, with a lower and an upper bound.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace tractiond::capture {

/// Reading of a clock at some moment between two readings of the host's. The host's clock is CLOCK_MONOTONIC_RAW, which
/// is neither set nor slewed.
struct ClockReading {
  std::int64_t device_ns = 0;
  std::int64_t before_ns = 0, after_ns = 0;
};

/// Reentrant; a copy is some kilobytes without pointers. Allocates nothing.
///
/// Model: host - device = y(device), with |y'| <= 1000 ppm and |y''| <= wander, 1 ppm per second. Each reading bounds y
/// at its own place. Two readings bound the mean of y' between them; y' elsewhere differs from it by at most wander
/// times the distance to their middle, and y differs from the tangent by at most half of wander times the distance
/// squared. The result is what all readings allow, with no assumption about when between the two readings of the host's
/// clock the device was read (Marzullo and Owicki 1983; Cristian 1989).
class ClockFit {
 public:
  /// On the host's clock, both included.
  struct Span {
    std::int64_t earliest_ns = 0, latest_ns = 0;
  };

  /// Adds the next reading. Forgets the readings before if it contradicts them or comes more than 30 s after the last
  /// one: the clock was set. Of more than 128 the oldest is dropped.
  void add(const ClockReading& reading);

  /// Returns when the clock showed `device_ns`. Returns nothing if that is more than 30 s before or after the newest
  /// reading, if there are fewer than two readings since the clock was set, or if they leave no time for it.
  /// \param resolution_ns rounding of `device_ns`, up or down
  std::optional<Span> at(std::int64_t device_ns, std::int64_t resolution_ns = 0) const;

  std::size_t readings() const { return count_; }  ///< Returns the number of readings in use, at most 128.
  /// Returns the time between the oldest and the newest reading in use [ns]; 0 for fewer than two.
  std::int64_t span_ns() const;

 private:
  static constexpr std::size_t kMost = 128;
  /// A reading relative to the newest one: its place on the device clock, and the bounds of y there.
  struct Bound {
    double x_ns = 0, low_ns = 0, high_ns = 0;
  };

  void learnResolution(std::int64_t elapsed_ns);
  std::optional<Span> expected(std::int64_t device_ns, std::int64_t resolution_ns) const;
  bool fit();

  std::array<ClockReading, kMost> ring_{};
  std::size_t next_ = 0, count_ = 0;
  std::array<Bound, kMost> bounds_{};
  double slowest_ = 0, fastest_ = 0;  ///< y' at the newest reading
  std::int64_t resolution_ns_ = 0;    ///< all differences of readings are multiples of it
  int differences_ = 0;               ///< number from which it was learnt, up to a sufficient one
};

}  // namespace tractiond::capture
