// Measures, while nothing touches, the noise of the markers and the motion of the whole picture.
#pragma once

#include "daemon/calibrate/picture_motion.h"

#include <vector>

namespace tractiond::calibrate {

struct RestNoise {
  int frames = 0;                ///< number of frames used
  double centre_px = 0.0;        ///< deviation of a marker's coordinate in one frame, without the picture's motion
  double overPromised = 0.0;     ///< centre_px / the tracker's own estimate of it; 1: the tracker is right
  sensor::PictureMotion motion;  ///< root mean squares from the zero, without the fit's own noise
  Bulge bulge;                   ///< of the mean displacement: found() if something touches
};

/// Thread-bound. The sensor must outlive it.
class RestNoiseMeter {
 public:
  static constexpr int kFewestFrames = 30;  ///< for a useful result

  explicit RestNoiseMeter(const sensor::Sensor& sensor);

  /// Adds a frame; ignores it if fewer than ten markers are valid. Checks neither its flags nor its zero.
  void add(const MarkerField& field);
  /// Returns the number of frames used so far.
  int frames() const { return frames_; }

  /// Evaluates the frames added so far; there must be at least two (asserted). Markers that were valid in fewer than
  /// two frames are left out.
  RestNoise summary() const;

 private:
  struct Sums {
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    double square = 0.0;
    int count = 0;
  };

  const sensor::Sensor& sensor_;
  PictureMotionFit fit_;
  std::vector<Sums> markers_;  ///< of what remains after the picture's motion
  Eigen::Vector4d motionSquare_ = Eigen::Vector4d::Zero(), motionNoise_ = Eigen::Vector4d::Zero();
  double promised_ = 0.0;  ///< sum of the frames' mean variances
  int frames_ = 0;
};

}  // namespace tractiond::calibrate
