// Chooses the markers of a frame that forces are solved from.
#pragma once

#include "daemon/records/marker_field.h"
#include "daemon/solve/kernels.h"
#include "daemon/solve/options.h"

#include <cstdint>
#include <span>
#include <vector>

namespace tractiond::solve {

/// Thread-bound. Allocates only when made.
class UsedMarkers {
 public:
  UsedMarkers(int markers, const SolveOptions& options);

  /// Takes the valid markers but for those whose variance is many times that of the others: the equations weigh all
  /// alike. Returns whether they suffice.
  bool take(const MarkerField& markers);

  // Of the last take().
  std::span<const std::uint8_t> used() const { return used_; }                ///< M, 1: the marker is used
  std::span<const int> coordinates() const { return coordinates_; }           ///< of the used markers, rising
  std::span<const float> displacements_px() const { return displacements_; }  ///< at these
  std::span<const int> missing() const { return missing_; }                   ///< the other coordinates, rising
  std::span<const double> row_px() const { return row_; }                     ///< 2M, padded; 0 where missing
  double squares_px2() const { return squares_; }                             ///< of the displacements, their sum
  double noise_px() const { return noise_px_; }                               ///< of this frame

 private:
  const SolveOptions options_;
  std::vector<std::uint8_t> used_;
  std::vector<int> coordinates_, missing_;
  std::vector<float> displacements_;
  std::vector<double> row_;
  double squares_ = 0.0, noise_px_ = 0.0;
};

}  // namespace tractiond::solve
