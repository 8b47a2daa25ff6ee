// Watches the rest pose drift while nothing touches. It never mends it: a zero is taken when a person asks.
#pragma once

#include "daemon/calibrate/picture_motion.h"
#include "daemon/records/rest_drift.h"

#include <vector>

namespace tractiond::calibrate {

struct DriftOptions {
  double average_s = 3.0;      ///< that the mean runs over: vibration goes, heat stays
  double allowance_px = 0.02;  ///< smooth displacement that is no touch yet: heat, creep
  double largest = 5.0;        ///< deviations of the picture's motion that are worth a warning
};

/// Thread-bound.
class DriftWatch {
 public:
  explicit DriftWatch(const sensor::Sensor& sensor, const DriftOptions& options = {});

  void add(const MarkerField& field);

  const RestDrift& drift() const { return drift_; }

  /// The drift is larger than the sensor's picture motion explains. True once; again after it has been small or a zero
  /// has been taken.
  bool takeWarning();

 private:
  double edge_px(double shift_px, double scale, double roll) const;

  const sensor::Sensor& sensor_;
  DriftOptions options_;
  PictureMotionFit fit_;
  RestDrift drift_;
  std::vector<float> mean_px_;  ///< 2 M
  std::vector<float> rest_px_;  ///< 2 M, this frame's without the picture's motion
  Id zero_{};
  bool warned_ = false;
};

}  // namespace tractiond::calibrate
