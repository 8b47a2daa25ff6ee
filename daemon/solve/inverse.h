// Computes the regularised inverse of an influence matrix, factored so that little memory is read for a frame.
//
//   d = H f + P m + noise  the displacements: forces f, and motion m of the whole picture with covariance Q
//   W = (1 + P Q P' / n^2)^-1                  the weight of the displacements, n [px] being their noise; P Q^1/2 / n
//                                              has the left singular vectors R and W = 1 - R D R', D = e^2 / (1 + e^2)
//   W^1/2 H = U S V'       the influence matrix that the motion leaves, 2M x 3N, its r largest singular values s [px/N]
//   f = V S^-1 G U' W^1/2 d  with g = s^2 / (s^2 + lambda^2): the forces that minimise
//                            |d - H f - P m|^2 + n^2 m' Q^-1 m + lambda^2 |f|^2 over f and m
#pragma once

#include "base/error.h"
#include "daemon/records/marker_field.h"
#include "daemon/solve/kernels.h"
#include "daemon/solve/motion_weight.h"
#include "daemon/solve/options.h"

#include <tl/expected.hpp>

#include <array>
#include <vector>

namespace tractiond::solve {

/// Errors of the computed wrench (force and moment) of a load by one standard deviation of each quantity that is not
/// known exactly: 6 x 6 matrices, row after row, for the camera's position x, y, z, rotation x, y, z and focal length,
/// and for a block's Poisson's ratio, thickness and depth of each layer.
struct SystematicErrors {
  std::vector<double> contact;    ///< if only the nodes around a small contact are solved for
  std::vector<double> wholeFace;  ///< if all nodes are solved for: part of a block's own bending appears as forces

  /// Errors by depths that scatter from marker to marker (Uncertainty::markerDepth; empty where that is 0): 6 x 3
  /// matrices E, row after row. A force F has an error of force and moment about its place with the covariance
  /// sum E F F' E'.
  std::vector<double> contactScatter, wholeFaceScatter;
};

/// Immutable once made; any thread may read it.
struct Inverse {
  Id id{};                             ///< of everything the numbers depend on: the calibration published with a field
  std::int64_t computed_ns = 0;        ///< CLOCK_REALTIME when it was computed
  double lambda = 0.0;                 ///< [px/N]
  std::vector<double> singularValues;  ///< r, falling [px/N]
  RowMatrix left;                      ///< [W^1/2 U, R], 2M x (r + 4)
  RowMatrix right;                     ///< V', r x 3N
  std::vector<double> motionGain;      ///< D, 4
  std::vector<double> motionVariance;  ///< the diagonal of Q [px^2, px^2, 1, rad^2]
  std::vector<float> hat;              ///< 1 - W + W^1/2 U G U' W^1/2, lower triangle by rows: 2M (2M + 1) / 2
  RowMatrix influence;                 ///< H', 3N x 2M [px/N]
  std::vector<double> gram;            ///< H'H, its lower triangle row after row: 3N (3N + 1) / 2 [px^2/N^2]
  RowMatrix motion;                    ///< P', 4 x 2M
  SystematicErrors systematicErrors;

  int coordinateCount() const { return left.rows(); }  ///< 2M
  int forceCount() const { return right.columns(); }   ///< 3N
  int rank() const { return right.rows(); }            ///< r

  /// Returns the element (i, j) of `hat`, which is symmetric: the share of coordinate j in the fit at coordinate i.
  float hatAt(int i, int j) const {
    const auto [high, low] =
        i > j ? std::pair<std::size_t, std::size_t>(i, j) : std::pair<std::size_t, std::size_t>(j, i);
    return hat[high * (high + 1) / 2 + low];
  }
};

/// Computes the inverse of `influence`, 2M x 3N [px/N], in double precision. Uses the threads of the BLAS, and about
/// four times the memory of the matrix. Leaves `id`, `computed_ns` and `systematicErrors` to the caller. Fails if the
/// matrix is not finite or all zero (EX_CONFIG), or if its eigenvectors are not found (EX_SOFTWARE). Takes seconds.
/// `influence` and `motion` need not outlive the result.
tl::expected<Inverse, Error> computeInverse(const Eigen::MatrixXd& influence, const MotionPrior& motion,
                                            const SolveOptions& options,
                                            const sensor::elastic::Progress& progress = {});

}  // namespace tractiond::solve
