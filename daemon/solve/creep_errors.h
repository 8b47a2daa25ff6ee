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
  /// Relative errors of forces, one for each error of a creep term: how far it is off if that error is one standard
  /// deviation. The errors are independent.
  using Shares = Eigen::Matrix<double, kMost, 1>;

  /// Copies what it needs of the sensor.
  explicit CreepErrors(const sensor::Sensor& sensor);

  /// Computes all results for a frame, which must outlive the calls below. They are 0 for a gel without known creep.
  void take(const MarkerField& markers);

  /// Returns the relative errors of the resultant.
  const Shares& ofAll() const { return ofAll_; }
  /// Returns the relative errors of the forces near a place, from the displacements of the markers around it. Subtracts
  /// a quadratic surface from these first, as forces elsewhere displace them that way.
  /// \param at place, gel frame [m]
  Shares about(const Eigen::Vector3d& at) const;
  /// Returns the noise that the errors add to a displacement [px]: the standard deviation of what is not in proportion
  /// to the displacements of now, weighted towards markers that move most (noiseWithMechanics_px()).
  double noise_px() const { return noise_px_; }
  /// Returns the root of the sum, over all coordinates and all errors, of the squared displacements that one standard
  /// deviation of an error causes [px].
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
