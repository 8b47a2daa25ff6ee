// Takes the coordinates of missing markers out of the equations.
//
// Let the missing coordinates have the displacements x that leave them no residual; then the full system's solution is
// the solution without them. With c = U'd, where d is zero at the missing rows M, and the fit U G U'd:
//   (I - U_M G U_M') x = U_M G c        a small system, positive definite, and constant while the same markers miss
//   c <- c + U_M' x
// Its Cholesky factor grows by two rows for a marker that goes missing. Where one comes back, the factor is cut before
// that marker and grown again with those behind it, so markers that come and go gather at the cheap end.
#pragma once

#include "daemon/solve/inverse.h"

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace tractiond::solve {

/// Thread-bound. Allocates only when made.
class MissingMarkers {
 public:
  explicit MissingMarkers(const Inverse& inverse);

  /// Brings the factor up to date with `valid` (M, 0: missing). Returns false where rounding leaves nothing to solve
  /// with; coordinates() is empty then. Costs nothing when the set is the same; at worst one factorisation, k^3 / 3 for
  /// k coordinates.
  bool update(std::span<const std::uint8_t> valid);

  /// The missing coordinates (rows of U); their order is that of solve().
  std::span<const int> coordinates() const { return {coordinates_.data(), coordinates_.size()}; }

  /// Solves for x in place.
  void solve(double* rightHandSide) const;

 private:
  std::span<const double> factor() const;
  bool append(int coordinate);

  const Inverse& inverse_;
  std::vector<int> coordinates_;
  std::vector<std::uint8_t> listed_;  // M, 1: the marker is among coordinates_
  std::vector<int> waiting_;          // markers to append
  // Packed as solveLower() wants it, with room for all markers. Memory that is not used is never touched.
  std::unique_ptr<double[]> factor_;
};

}  // namespace tractiond::solve
