// The singular values and vectors come from the eigenvectors of A'A, A = W^1/2 H, the smaller of the two Gram matrices:
// four times faster than a singular value decomposition of A itself. Squaring costs precision only where it does not
// matter: an eigenvalue is right within 1e-15 s0^2, so the smallest singular value kept, about 5e-4 s0, is right within
// 1e-8 of itself, and the columns of U = A V S^-1 are orthonormal within 1e-9; both are below what single precision
// keeps. Where neighbouring eigenvectors mix, the filter hardly tells them apart either.
//
// What the contact step needs, H and H'H, must fit together better than single precision: H'H is that of the rounded H.
#include "daemon/solve/inverse.h"

#include "sensor/elastic/linear_algebra.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace tractiond::solve {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using sensor::elastic::Op;

/// Singular values below this share of the largest drown in the rounding of H'H, whatever the options say.
constexpr double kSmallest = 1e-6;

template <typename Matrix>
void appendLower(const Matrix& matrix, std::size_t size, auto& packed) {
  packed.reserve(size * (size + 1) / 2);
  for (Eigen::Index i = 0; i < static_cast<Eigen::Index>(size); ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) {
      packed.push_back(static_cast<typename std::decay_t<decltype(packed)>::value_type>(matrix(i, j)));
    }
  }
}

/// Of the matrix whose Gram matrix this is, by the power method; within 1e-4.
double largestSingularValue(const MatrixXd& gram) {
  VectorXd vector = gram.diagonal();
  double square = 0.0;
  for (int i = 0; i < 100; ++i) {
    vector.normalize();
    vector = gram.selfadjointView<Eigen::Lower>() * vector;
    square = vector.norm();
  }
  return std::sqrt(square);
}

}  // namespace

tl::expected<Inverse, Error> computeInverse(const MatrixXd& influence, const MotionPrior& motion,
                                            const SolveOptions& options, const sensor::elastic::Progress& progress) {
  assert(options.regularisation > 0.0 && options.truncation >= 0.0 && options.noise_px > 0.0);
  assert(motion.modes.rows() == influence.rows() && motion.modes.cols() == kMotions);
  const auto report = [&](double fraction) {
    if (progress) progress(fraction);
  };
  report(0.0);
  if (!influence.allFinite() || influence.isZero(0.0)) {
    return tl::unexpected(Error{EX_CONFIG, "the influence matrix is not finite or all zero", "the gel and camera",
                                "check their sizes, Young's modulus and Poisson's ratio"});
  }
  const auto coordinates = static_cast<int>(influence.rows());
  const auto forces = static_cast<int>(influence.cols());

  const MotionWeight weight(motion, options.noise_px);
  const Eigen::Vector4d motionGain = weight.gain();

  Inverse inverse;
  MatrixXd weighed = influence.cast<float>().cast<double>();
  MatrixXd vectors(forces, forces);
  sensor::elastic::multiplyBySelf(1.0, weighed, Op::kTransposed, 0.0, vectors);
  appendLower(vectors, static_cast<std::size_t>(forces), inverse.gram);
  const double largest = largestSingularValue(vectors);
  weighed = influence;
  weight.apply(weighed);
  sensor::elastic::multiplyBySelf(1.0, weighed, Op::kTransposed, 0.0, vectors);
  report(0.1);
  VectorXd eigenvalues;  // rising
  if (!sensor::elastic::eigenvectors(vectors, eigenvalues)) {
    return tl::unexpected(Error{EX_SOFTWARE, "the influence matrix's eigenvectors were not found", "", ""});
  }
  report(0.7);

  inverse.lambda = options.regularisation * largest;
  const double smallest = std::max(options.truncation * inverse.lambda, kSmallest * largest);
  for (int i = forces - 1; i >= 0 && eigenvalues[i] > smallest * smallest; --i) {
    inverse.singularValues.push_back(std::sqrt(eigenvalues[i]));
  }
  const auto rank = static_cast<int>(inverse.singularValues.size());
  const VectorXd s = VectorXd::Map(inverse.singularValues.data(), rank);
  const MatrixXd v = vectors.rightCols(rank).rowwise().reverse();
  vectors.resize(0, 0);

  MatrixXd u(coordinates, rank);
  sensor::elastic::multiply(1.0, weighed, Op::kPlain, v, Op::kPlain, 0.0, u);
  weighed.resize(0, 0);
  u *= s.cwiseInverse().asDiagonal();
  weight.apply(u);
  MatrixXd left(coordinates, rank + kMotions);
  left << u, weight.axes();
  inverse.left = toRows(left);
  inverse.right = toRows(v.transpose());
  inverse.influence = toRows(influence.transpose());
  inverse.motion = toRows(motion.modes.transpose());
  inverse.motionGain.assign(motionGain.begin(), motionGain.end());
  inverse.motionVariance.assign(motion.variances.begin(), motion.variances.end());
  report(0.8);

  // With Q = [W^1/2 U, R] times the roots of the gains, the hat matrix is Q Q'.
  left.leftCols(rank) *=
      (s.array() / (s.array().square() + inverse.lambda * inverse.lambda).sqrt()).matrix().asDiagonal();
  left.rightCols(kMotions) *= motionGain.cwiseSqrt().asDiagonal();
  MatrixXd hat(coordinates, coordinates);
  sensor::elastic::multiplyBySelf(1.0, left, Op::kPlain, 0.0, hat);
  appendLower(hat, static_cast<std::size_t>(coordinates), inverse.hat);
  report(1.0);
  return inverse;
}

}  // namespace tractiond::solve
