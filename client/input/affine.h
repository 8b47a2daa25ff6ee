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

/// Returns the counts of the six components of a wrench.
std::array<std::int32_t, 6> axesOf(const Wrench& wrench, const AxesOptions& options);

struct ZoomOptions {
  double deadZone_Pa_m = 5e5;  ///< of the dilation; three deviations of it are one as well
  double gain = 1e-5;          ///< notches of a wheel per second, for each Pa/m beyond the dead zone
};

/// Returns what is beyond the dead zone, and beyond three deviations.
double beyond(double value, double deviation, double deadZone);

/// The dilation of the whole field as a wheel that turns the faster the more it is spread. Thread-bound.
class Zoom {
 public:
  explicit Zoom(const ZoomOptions& options)
      : options_(options) {}

  /// Returns the notches that the wheel turns in a field; above 0, away from the user.
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
  /// Returns the motion so far; that of the last gesture, until two touches begin another.
  const Similarity& follow(const Touches& touches);

 private:
  std::vector<Touch> before_;  ///< those of the last field with all of them
  bool isUnderWay_ = false;
  Similarity sum_;
};

}  // namespace traction::input
