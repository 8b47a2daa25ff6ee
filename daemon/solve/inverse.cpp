// The singular values and vectors come from the eigenvectors of H'H, the smaller of the two Gram matrices: four times
// faster than a singular value decomposition of H itself. Squaring costs precision only where it does not matter: an
// eigenvalue is right within 1e-15 s0^2, so the smallest singular value kept, about 5e-4 s0, is right within 1e-8 of
// itself, and the columns of U = H V S^-1 are orthonormal within 1e-9; both are below what single precision keeps.
// Where neighbouring eigenvectors mix, the filter hardly tells them apart either.
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

template <typename Source>
RowMatrix toRows(const Source& source) {
  RowMatrix rows(static_cast<int>(source.rows()), static_cast<int>(source.cols()));
  for (int i = 0; i < rows.rows(); ++i) {
    for (int j = 0; j < rows.columns(); ++j) rows.row(i)[j] = static_cast<float>(source(i, j));
  }
  return rows;
}

}  // namespace

tl::expected<Inverse, Error> computeInverse(const MatrixXd& influence, const SolveOptions& options,
                                            const sensor::elastic::Progress& progress) {
  assert(options.regularisation > 0.0 && options.truncation >= 0.0);
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

  MatrixXd vectors(forces, forces);
  sensor::elastic::multiplyBySelf(1.0, influence, Op::kTransposed, 0.0, vectors);
  report(0.1);
  VectorXd eigenvalues;  // rising
  if (!sensor::elastic::eigenvectors(vectors, eigenvalues)) {
    return tl::unexpected(Error{EX_SOFTWARE, "the influence matrix's eigenvectors were not found", "", ""});
  }
  report(0.7);

  Inverse inverse;
  const double largest = std::sqrt(eigenvalues[forces - 1]);
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
  sensor::elastic::multiply(1.0, influence, Op::kPlain, v, Op::kPlain, 0.0, u);
  u *= s.cwiseInverse().asDiagonal();
  inverse.left = toRows(u);
  inverse.right = toRows(v.transpose());
  report(0.8);

  // With Q = U G^1/2, the hat matrix is Q Q'.
  u *= (s.array() / (s.array().square() + inverse.lambda * inverse.lambda).sqrt()).matrix().asDiagonal();
  MatrixXd hat(coordinates, coordinates);
  sensor::elastic::multiplyBySelf(1.0, u, Op::kPlain, 0.0, hat);
  inverse.hat.reserve(static_cast<std::size_t>(coordinates) * (static_cast<std::size_t>(coordinates) + 1) / 2);
  for (int i = 0; i < coordinates; ++i) {
    for (int j = 0; j <= i; ++j) inverse.hat.push_back(static_cast<float>(hat(i, j)));
  }
  report(1.0);
  return inverse;
}

}  // namespace tractiond::solve
