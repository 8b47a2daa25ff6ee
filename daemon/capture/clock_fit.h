// Maps a device clock that can be read onto the host's clock, with bounds on both sides.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace tractiond::capture {

/// A reading of the device clock, taken between two readings of the host's clock, CLOCK_MONOTONIC_RAW, which is never
/// set or slewed.
struct ClockReading {
  std::int64_t device_ns = 0;
  std::int64_t before_ns = 0, after_ns = 0;
};

/// Reentrant; a copy is some kilobytes without pointers. Allocates nothing.
///
/// host - device = y(device), with |y'| <= largestRate and |y''| <= wander. Each reading bounds y at its own place. Two
/// bound the mean of y' between them, which y' at any other place differs from by wander times the way to their middle;
/// and y elsewhere differs from the tangent by half of wander times the way squared. What all readings allow is the
/// answer: no assumption is made of when, between the two looks, a clock was read (Marzullo and Owicki 1983; Cristian
/// 1989).
class ClockFit {
 public:
  struct Options {
    double largestRate = 1000e-6;  ///< a crystal's 500 ppm, and as many of the host's
    double wander_per_s = 1e-6;    ///< of that rate: a crystal that warms by a degree a second
  };
  /// On the host's clock, both included.
  struct Span {
    std::int64_t earliest_ns = 0, latest_ns = 0;
  };

  ClockFit() = default;
  explicit ClockFit(const Options& options)
      : options_(options) {}

  /// Adds the next reading. If no clock within the options can show it after the earlier ones, the clock was set, and
  /// the earlier ones are discarded.
  void add(const ClockReading& reading);

  /// Returns when the clock showed this. Returns nothing if it was not read within half a minute of it, or not twice
  /// since it was set. \param resolution_ns to which `device_ns` was rounded, up or down
  std::optional<Span> at(std::int64_t device_ns, std::int64_t resolution_ns = 0) const;

  std::size_t readings() const { return count_; }  ///< number in use

 private:
  static constexpr std::size_t kMost = 64;
  /// A reading relative to the newest one: its place on the device clock, and the bounds of y there.
  struct Bound {
    double x_ns = 0, low_ns = 0, high_ns = 0;
  };

  void learnResolution(std::int64_t elapsed_ns);
  std::optional<Span> expected(std::int64_t device_ns, std::int64_t resolution_ns) const;
  bool fit();

  Options options_;
  std::array<ClockReading, kMost> ring_{};
  std::size_t next_ = 0, count_ = 0;
  std::array<Bound, kMost> bounds_{};
  double slowest_ = 0, fastest_ = 0;  ///< y' at the newest reading
  std::int64_t resolution_ns_ = 0;    ///< all differences of readings are multiples of it
  int differences_ = 0;               ///< number from which it was learnt, up to a sufficient one
};

}  // namespace tractiond::capture
