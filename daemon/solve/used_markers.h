// Chooses the markers of a frame that forces are solved from.
#pragma once

#include "daemon/records/marker_field.h"
#include "daemon/solve/kernels.h"
#include "daemon/solve/options.h"

#include <span>
#include <vector>

namespace tractiond::solve {

/// Thread-bound. Allocates only when made.
class UsedMarkers {
 public:
  /// \param markers M, the number of markers of the sensor
  UsedMarkers(int markers, const SolveOptions& options);

  /// Chooses the valid markers, except those whose variance exceeds 16 times both the mean variance and the
  /// calibrated one, as the equations weigh all alike. Copies what it needs of `markers`. Returns whether there are
  /// enough of them, by SolveOptions::fewestMarkers(); if not, the results below have no meaning.
  bool choose(const MarkerField& markers);

  // Results of the last choose(). Coordinate 2 m is u of marker m, 2 m + 1 is v. Displacements are
  // MarkerField::byForces_px().

  /// Returns the number of used coordinates, two of each marker.
  int count() const { return count_; }
  /// Returns the coordinates that are not used, ascending.
  std::span<const int> missing() const { return missing_; }
  /// Returns the displacements, 2M, padded; 0 if missing.
  std::span<const double> row_px() const { return row_; }
  /// Returns the displacements, 2M, as floats; 0 if missing.
  std::span<const float> rounded_px() const { return rounded_; }
  /// Returns the variance of a coordinate of each marker, M; 0 if missing.
  std::span<const float> variance_px2() const { return variance_; }
  /// Returns the sum of the squared displacements.
  double squares_px2() const { return squares_; }
  /// Returns the standard deviation of a coordinate in this frame, by the used markers' mean variance; the calibrated
  /// one if that is 0.
  double noise_px() const { return noise_px_; }

 private:
  const SolveOptions options_;
  const std::size_t markers_;
  int count_ = 0;
  std::vector<int> missing_;
  std::vector<double> row_;
  std::vector<float> rounded_, variance_;
  double squares_ = 0.0, noise_px_ = 0.0;
};

}  // namespace tractiond::solve
