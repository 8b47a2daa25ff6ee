// What moves while nothing touches: each marker's own noise, and the picture as a whole.
#pragma once

#include "daemon/calibrate/picture_motion.h"

#include <vector>

namespace tractiond::calibrate {

struct RestNoiseOptions {
  int fewestFrames = 30;
  double allowance_px = 0.02;  ///< smooth displacement that is no touch: heat, creep
  /// Below these a look of seconds cannot promise anything for the hours until the next zero.
  sensor::PictureMotion least = {.shift_px = 2e-3, .scale = 5e-6, .roll = 5e-6};
};

struct RestNoise {
  int frames = 0;                ///< that counted
  double centre_px = 0.0;        ///< deviation of a marker's coordinate in one frame, the picture's motion taken out
  double overPromised = 0.0;     ///< that over what the tracker said of itself; 1: it spoke true
  sensor::PictureMotion motion;  ///< deviations from the zero, the fit's own noise taken out
  Bulge bulge;                   ///< of the mean displacement: found() if something touches
};

/// Thread-bound.
class RestNoiseMeter {
 public:
  explicit RestNoiseMeter(const sensor::Sensor& sensor, const RestNoiseOptions& options = {});

  void add(const MarkerField& field);
  int frames() const { return frames_; }

  /// After at least options.fewestFrames.
  RestNoise summary() const;

 private:
  struct Sums {
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    double square = 0.0;
    int count = 0;
  };

  const sensor::Sensor& sensor_;
  RestNoiseOptions options_;
  PictureMotionFit fit_;
  std::vector<Sums> markers_;  ///< of what remains after the picture's motion
  Eigen::Vector4d motionSquare_ = Eigen::Vector4d::Zero(), motionNoise_ = Eigen::Vector4d::Zero();
  double promised_ = 0.0;  ///< sum of the frames' mean variances
  int frames_ = 0;
};

}  // namespace tractiond::calibrate
