// Computes a picture's amplitudes in the modes of the atoms' influence; completes the displacements of missing markers.
#pragma once

#include "daemon/solve/strong_modes.h"

#include <memory>
#include <span>
#include <vector>

namespace tractiond::solve {

/// Thread-bound. Allocates only when made.
class Amplitudes {
 public:
  /// `factors` must outlive it.
  Amplitudes(const Factors& factors, std::shared_ptr<const StrongModes> strong);

  /// Starts with a frame's displacements, 2M [px], 0 at the missing coordinates, and no modes. Both must live until the
  /// next begin().
  void begin(std::span<const float> displacement_px, std::span<const int> missing);

  /// Computes the amplitudes of the first `modes` modes, at least as many as were read and at most Factors::rank().
  /// Forgets what complete() found.
  void read(int modes);

  /// Completes the displacements of the missing coordinates, so that they have no residual after a fit of forces of the
  /// typical size `force_N` and of the picture's motion: d_m = K_mm d_m + K_mv d_v, where K maps displacements to their
  /// fit by the modes that were read. Uses conjugate gradients, starting from the displacements of the last call, so
  /// that it can be called again with a better `force_N`. Changes values(). Must be called after read().
  /// \param force_N [N]
  /// \param noise_px standard deviation of a coordinate
  void complete(double force_N, double noise_px);

  /// Returns the displacements of the missing coordinates, in their order [px]: 0 until complete() is called.
  std::span<const double> completed() const { return std::span(completed_).first(missing_.size()); }

  /// Returns the amplitudes of the modes that were read [px]; none after begin(). Valid until the next call of another
  /// function.
  std::span<const double> values() const;

 private:
  void fit(const double* amplitudes, std::vector<double>& displacement);
  void project(std::span<const double> displacement, double* amplitudes);

  const RowMatrix& left() const;

  const Factors& factors_;
  const std::shared_ptr<const StrongModes> strong_;
  // Of the motion, then of the modes.
  LineArray<double> there_, all_;  // amplitudes: of the coordinates that are not missing, of all
  LineArray<float> filtered_;      // amplitudes, scratch
  std::vector<double> gain_;
  int columns_ = 0;  // motion and modes that were read
  std::span<const float> displacement_;
  std::span<const int> missing_;
  std::vector<int> everyCoordinate_;
  std::vector<float> coefficients_;
  std::vector<double> completed_, residual_, direction_, image_;  // of the missing coordinates
};

}  // namespace tractiond::solve
