// Computes the displacements of missing markers that have the same effect as leaving their equations out.
//
// If the missing coordinates have the displacements x for which they have no residual, then the solution of the full
// system is the solution without them. With c = U'd, where d is zero at the missing rows M, and the fit U G U'd:
//   (I - U_M G U_M') x = U_M G c        a small positive definite system, constant while the same markers are missing
//   c <- c + U_M' x
// Its Cholesky factor grows by two rows for each marker that is lost. When a marker is found again, the factor is cut
// before it and grown again by the markers behind it. Markers that are often lost and found are therefore near the end,
// where this is cheap.
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
  /// `inverse` must outlive it.
  explicit MissingMarkers(const Inverse& inverse);

  /// Updates the factor for the markers that are missing (`valid`: M, 0: missing). Returns false if the system cannot
  /// be solved because of rounding; coordinates() is then empty. Costs nothing if the set is the same; at worst one
  /// factorisation, k^3 / 3 operations for k coordinates.
  bool update(std::span<const std::uint8_t> valid);

  /// Returns the missing coordinates (rows of U) in the order of solve().
  std::span<const int> coordinates() const { return {coordinates_.data(), coordinates_.size()}; }

  /// Solves the system of the last update() in place: U_M G c is replaced by x [px], one element for each of
  /// coordinates().
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
