// What the whole field does, as motion: six axes of force and moment, and the gesture of several fingers.
#pragma once

#include "client/input/touches.h"

#include <array>
#include <cstdint>
#include <vector>

namespace traction::input {

struct AxesOptions {
  double deadZone_N = 0.2;     ///< of each component of the force
  double deadZone_Nm = 0.004;  ///< of each component of the moment
  double gain_N = 60.0;        ///< counts per newton beyond the dead zone
  double gain_Nm = 5'000.0;    ///< counts per newton metre beyond the dead zone
};

/// Largest count of an axis: that of a 3-D mouse.
inline constexpr int kMostCounts = 350;

/// Converts force and moment into counts of a 3-D mouse, in the same order: the part of each component beyond its dead
/// zone, times the gain, rounded, and limited to kMostCounts.
std::array<std::int32_t, 6> axesOf(const Wrench& wrench, const AxesOptions& options);

struct ZoomOptions {
  double deadZone_Pa_m = 5e5;  ///< of the dilation; three deviations of it are one as well
  double gain = 1e-5;          ///< notches of a wheel per second, for each Pa/m beyond the dead zone
};

/// Returns the part of a value beyond the dead zone or three of its deviations, whichever is larger, with its sign; 0
/// within them. All are in one unit.
double beyond(double value, double deviation, double deadZone);

/// Turns the dilation of the whole field into a wheel, which turns the faster the more the gel is spread. Thread-bound.
class Zoom {
 public:
  explicit Zoom(const ZoomOptions& options)
      : options_(options) {}

  /// Returns the number of whole notches by which the wheel turns in a field; above 0: away from the user. Keeps the
  /// rest for the next field. Returns 0 in the first field with touches, and if the field is not valid.
  int step(const Touches& touches);

 private:
  ZoomOptions options_;
  std::int64_t time_ns_ = 0;  ///< of the last field with touches; 0: the last one had none
  double rest_ = 0.0;         ///< notches that are not sent yet
};

/// How the fingers have moved since there are several: the similarity that maps their places then to those now.
struct Similarity {
  std::array<double, 2> shift_m{};  ///< of their centre
  double turn_rad = 0.0;            ///< about their centre, from x towards y
  double scale = 1.0;               ///< of their distances
};

/// Adds up what two or more touches do from field to field, so that fingers may be put down and lifted meanwhile.
/// Thread-bound.
class Gesture {
 public:
  /// Adds the motion since the field before. Returns the motion of the gesture so far, which remains that of the last
  /// one until two touches begin another. Ignores a field in which one of the touches is not seen.
  const Similarity& follow(const Touches& touches);

 private:
  std::vector<Touch> before_;  ///< those of the last field with all of them
  bool isUnderWay_ = false;
  Similarity sum_;
};

}  // namespace traction::input
