// What the whole picture does, apart from its markers: shift, scale and roll; and what remains, looked at smoothly.
#pragma once

#include "daemon/records/marker_field.h"
#include "sensor/sensor.h"

#include <optional>
#include <span>

namespace tractiond::calibrate {

/// Displacements [px], (u, v) marker after marker, and which of them count.
struct Displacements {
  std::span<const float> value_px;      ///< 2 M
  std::span<const std::uint8_t> valid;  ///< M
};

/// (u, v) moves by shift + scale (u, v) + roll (-v, u), counted from the principal point: sensor::Projection::motionOf.
struct PictureMotion {
  Eigen::Vector4d value = Eigen::Vector4d::Zero();       ///< shift u, v [px]; scale [1]; roll [rad], u towards v
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();  ///< by the scatter of what remains
  double rms_px = 0.0;                                   ///< of what remains, over the valid coordinates
};

/// Reentrant; immutable after construction.
class PictureMotionFit {
 public:
  explicit PictureMotionFit(const sensor::Sensor& sensor);

  /// Least squares over the valid markers; nothing where fewer than ten are.
  std::optional<PictureMotion> operator()(const Displacements& displacements) const;

  /// The displacement of marker i by such a motion [px].
  Eigen::Vector2d at(int marker, const Eigen::Vector4d& motion) const;

 private:
  Eigen::Matrix<double, Eigen::Dynamic, 4> byMotion_;  ///< d(u), d(v) / d(motion), marker after marker
};

/// A place where neighbouring markers agree that they are displaced: errors of single markers do not, a touch does.
struct Bulge {
  double size_px = 0.0;                             ///< norm of the median over 3 x 3 markers of a layer
  double limit_px = 0.0;                            ///< what scatter and a smooth error of the model may show
  Eigen::Vector2d place = Eigen::Vector2d::Zero();  ///< gel frame [m]

  bool found() const { return size_px > limit_px; }
};

/// The largest of all. The limit is six deviations of such a median, by the markers' scatter about it, and `allowance`.
Bulge largestBulge(const sensor::Sensor& sensor, const Displacements& displacements, double allowance_px);

}  // namespace tractiond::calibrate
