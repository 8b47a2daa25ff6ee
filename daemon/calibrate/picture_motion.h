// Separates the motion of the whole picture (shift, scale, roll) from displacements, and finds touches in the
// remainder.
#pragma once

#include "daemon/records/marker_field.h"
#include "sensor/sensor.h"

#include <optional>
#include <span>
#include <vector>

namespace tractiond::calibrate {

/// Displacements [px], (u, v) marker after marker, and which of them count.
struct Displacements {
  std::span<const float> value_px;      ///< 2 M
  std::span<const std::uint8_t> valid;  ///< M
};

/// Motion of the whole picture: (u, v) moves by shift + scale (u, v) + roll (-v, u), where (u, v) is counted from the
/// principal point and the pixels are square; for other aspects see sensor::Projection::motionOf.
struct PictureMotion {
  Eigen::Vector4d value = Eigen::Vector4d::Zero();       ///< shift u, v [px]; scale [1]; roll [rad], u towards v
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();  ///< of `value`, by the scatter of the residual
  double rms_px = 0.0;                                   ///< root mean square residual over the valid coordinates
};

/// Estimates the motion of the whole picture. Reentrant; immutable after construction.
class PictureMotionFit {
 public:
  /// The motion is about the principal point of the sensor's camera. The sensor need not outlive this.
  explicit PictureMotionFit(const sensor::Sensor& sensor);

  /// Estimates the motion by least squares over the valid markers; returns nothing if fewer than ten are valid.
  std::optional<PictureMotion> operator()(const Displacements& displacements) const;

  /// Returns the displacement (u, v) of a marker at rest under such a motion [px].
  /// \param marker index in the order of sensor::markerPositions
  /// \param motion PictureMotion::value
  Eigen::Vector2d at(int marker, const Eigen::Vector4d& motion) const;

  /// Returns the displacements without such a motion, 2 M, of all markers.
  std::vector<float> without(const Eigen::Vector4d& motion, std::span<const float> value_px) const;

 private:
  Eigen::Matrix<double, Eigen::Dynamic, 4> byMotion_;  ///< d(u), d(v) / d(motion), marker after marker
};

/// Largest smooth displacement by heat and creep between two zeros; a larger one is a touch.
inline constexpr double kUntouched_px = 0.02;

/// A place where neighbouring markers agree that they are displaced. A touch causes that, errors of single markers do
/// not.
struct Bulge {
  double size_px = 0.0;                             ///< norm of the median over 3 x 3 markers of a layer
  double limit_px = 0.0;                            ///< size that scatter and a smooth error of the model can cause
  Eigen::Vector2d place = Eigen::Vector2d::Zero();  ///< gel frame [m]

  bool found() const { return size_px > limit_px; }  ///< Returns whether something seems to touch.
};

/// Finds the largest bulge. Thread-bound. Allocates only when made.
class BulgeSearch {
 public:
  /// Copies what it needs of the sensor.
  explicit BulgeSearch(const sensor::Sensor& sensor);

  /// Returns the largest bulge of all layers; size 0 if there is no 3 x 3 neighbourhood with six valid markers. Its
  /// limit is six standard deviations of such a median, estimated from the markers' scatter, plus `allowance_px`.
  /// \param displacements without the motion of the whole picture, which would count as a bulge
  Bulge operator()(const Displacements& displacements, double allowance_px);

 private:
  const std::vector<sensor::MarkerLayer> layers_;
  const sensor::Points markers_;
  std::vector<double> squares_;  ///< squared differences of single markers from their neighbourhood
};

/// Returns BulgeSearch's result. Reentrant. Allocates.
Bulge largestBulge(const sensor::Sensor& sensor, const Displacements& displacements, double allowance_px);

}  // namespace tractiond::calibrate
