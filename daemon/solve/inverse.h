// The regularised inverse of an influence matrix, factored so that a frame streams few bytes.
//
//   H = U S V'             the influence matrix [px/N], 2M x 3N, its r largest singular values s
//   f = V S^-1 G U' d      with g = s^2 / (s^2 + lambda^2): the forces that minimise |d - H f|^2 + lambda^2 |f|^2
#pragma once

#include "daemon/base/error.h"
#include "daemon/records/marker_field.h"
#include "daemon/solve/kernels.h"
#include "daemon/solve/options.h"

#include <tl/expected.hpp>

#include <vector>

namespace tractiond::solve {

/// Immutable once made; any thread may read it.
struct Inverse {
  Id id{};                             ///< of everything the numbers depend on: the calibration published with a field
  std::int64_t computed_ns = 0;        ///< CLOCK_REALTIME when it was computed
  double lambda = 0.0;                 ///< [px/N]
  std::vector<double> singularValues;  ///< r, falling [px/N]
  RowMatrix left;                      ///< U, 2M x r
  RowMatrix right;                     ///< V', r x 3N
  std::vector<float> hat;              ///< U G U', its lower triangle row after row: 2M (2M + 1) / 2

  int coordinateCount() const { return left.rows(); }  ///< 2M
  int forceCount() const { return right.columns(); }   ///< 3N
  int rank() const { return right.rows(); }

  /// One element of U G U', the share of coordinate j in the fit at coordinate i.
  float hatAt(int i, int j) const {
    const auto [high, low] =
        i > j ? std::pair<std::size_t, std::size_t>(i, j) : std::pair<std::size_t, std::size_t>(j, i);
    return hat[high * (high + 1) / 2 + low];
  }
};

/// `influence` is 2M x 3N [px/N]. Double precision, the BLAS's threads, about four times the matrix's memory; `id` and
/// `computed_ns` are left to the caller. Fails if the matrix is not finite or all zero.
tl::expected<Inverse, Error> computeInverse(const Eigen::MatrixXd& influence, const SolveOptions& options,
                                            const sensor::elastic::Progress& progress = {});

}  // namespace tractiond::solve
