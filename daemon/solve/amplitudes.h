// Computes a picture's amplitudes in the modes of the atoms' influence; completes the displacements of missing markers.
#pragma once

#include "daemon/solve/factors.h"

#include <span>
#include <vector>

namespace tractiond::solve {

/// Thread-bound. Allocates only when made.
class Amplitudes {
 public:
  /// `factors` must outlive it.
  explicit Amplitudes(const Factors& factors);

  /// Starts with a frame's displacements, 2M [px], 0 at the missing coordinates, and no modes. Both must live until the
  /// next call.
  void take(std::span<const float> displacement_px, std::span<const int> missing);

  /// Computes the amplitudes of the first `modes` modes, at least as many as there are; the missing coordinates have no
  /// displacements again.
  void read(int modes);

  /// Gives the missing coordinates the displacements that forces of the usual size `force_N` and the picture's motion
  /// explain best, those that would leave them no residual: d_m = K_mm d_m + K_mv d_v, K being what the fit makes of
  /// displacements. Conjugate gradients, from the displacements of the last call on: each may name a better `force_N`.
  void complete(double force_N, double noise_px);

  /// [px], of the modes that were read.
  std::span<const double> values() const;

 private:
  void fit(const double* amplitudes, std::vector<double>& displacement);
  void project(std::span<const double> displacement, double* amplitudes);

  const Factors& factors_;
  // Of the motion, then of the modes.
  LineArray<double> there_, all_;  // amplitudes: of the coordinates that are there, of all
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
