// What errors of the gel's creep do to the forces of a frame. What is remembered as it now presses makes forces wrong
// in proportion; what is remembered otherwise is noise that looks like forces.
#pragma once

#include "daemon/records/marker_field.h"
#include "sensor/sensor.h"

namespace tractiond::solve {

/// Thread-bound. Allocates only when made.
class CreepErrors {
 public:
  static constexpr int kMost = sensor::kMostCreepTerms;
  /// By which share forces are wrong by one deviation of each of the errors, which are independent.
  using Shares = Eigen::Matrix<double, kMost, 1>;

  /// Copies what it needs of the sensor.
  explicit CreepErrors(const sensor::Sensor& sensor);

  /// Takes a frame, which must outlive the calls below.
  void take(const MarkerField& markers);

  /// Returns the shares of all forces together.
  const Shares& ofAll() const { return ofAll_; }
  /// Returns those of the forces about a place [m], by the markers there, less what is quadratic across these: forces
  /// elsewhere displace that.
  Shares about(const Eigen::Vector3d& at) const;
  /// Returns the standard deviation of a coordinate by the rest of the errors, where it is seen [px], as
  /// noiseWithMechanics_px().
  double noise_px() const { return noise_px_; }
  /// Returns the standard deviation of all displacements together [px].
  double displacement_px() const { return markers_->creepError_px; }

 private:
  const sensor::Points places_;  ///< of the markers
  const double reach_m_;
  const MarkerField* markers_ = nullptr;
  Eigen::VectorXf rest_;
  Shares ofAll_ = Shares::Zero();
  double noise_px_ = 0.0;
};

}  // namespace tractiond::solve
