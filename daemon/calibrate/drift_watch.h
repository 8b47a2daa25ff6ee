// Measures how the rest pose drifts while nothing touches. It does not correct the zero: an operator must request one.
#pragma once

#include "daemon/calibrate/picture_motion.h"
#include "daemon/records/rest_drift.h"

#include <vector>

namespace tractiond::calibrate {

struct DriftOptions {
  double average_s = 3.0;      ///< time constant of the means: they average vibration out, but not heat
  double allowance_px = 0.02;  ///< largest smooth displacement by heat and creep; a larger one is a touch
  double largest = 5.0;        ///< drift from which on there is a warning, in deviations of the picture's motion
};

/// Thread-bound. The sensor must outlive it. A touch is a bulge (largestBulge()) beyond DriftOptions::allowance_px.
class DriftWatch {
 public:
  explicit DriftWatch(const sensor::Sensor& sensor, const DriftOptions& options = {});

  /// Adds a frame to the means. Ignores a frame with a touch, with kFewMarkers, with fewer than ten valid markers, or
  /// without a zero (MarkerField::zero all 0). Starts anew when the zero changes. A mean begins with its first value
  /// after the zero, a marker's with the first frame that shows it, and a value weighs the more the longer the one
  /// before is ago. \param field of the sensor's markers; its `received_ns` is the time
  void add(const MarkerField& field);

  /// Returns the means, of which seen_ns is the time of the last frame that was used; 0: none since the zero.
  const RestDrift& drift() const { return drift_; }

  /// Returns whether the drift, at the edge of the picture, exceeds DriftOptions::largest deviations of the sensor's
  /// picture motion. Returns true once, and again only after a call has seen the drift below half of that limit, or the
  /// zero has changed.
  bool takeWarning();

 private:
  double edge_px(double shift_px, double scale, double roll) const;

  const sensor::Sensor& sensor_;
  DriftOptions options_;
  PictureMotionFit fit_;
  RestDrift drift_;
  std::vector<float> mean_px_;         ///< 2 M
  std::vector<std::int64_t> seen_ns_;  ///< M, time of the last frame that showed the marker and was used; 0: none
  std::vector<float> rest_px_;  ///< 2 M, displacements in this frame without the picture's motion
  Id zero_{};
  bool warned_ = false;
};

}  // namespace tractiond::calibrate
