// A clock that can be asked, on the host's: both sides of every moment of it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace tractiond::capture {

/// What a clock showed, at some moment between two looks at the host's. The host's is CLOCK_MONOTONIC_RAW: nobody sets
/// it, and nobody slews it.
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

  /// In turn. A reading that no clock within the options can have given after those before says that the clock was set:
  /// those before are forgotten.
  void add(const ClockReading& reading);

  /// When the clock showed this; none: it has not been read within half a minute of that, or not twice since it was
  /// set. \param resolution_ns what it is rounded to, up or down
  std::optional<Span> at(std::int64_t device_ns, std::int64_t resolution_ns = 0) const;

  std::size_t readings() const { return count_; }  ///< that it rests on

 private:
  static constexpr std::size_t kMost = 64;
  /// From the newest reading: its place on the device's clock, and there the bounds of y.
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
  int differences_ = 0;               ///< that it was learnt from, up to enough
};

}  // namespace tractiond::capture
