// The singular values and vectors come from the eigenvectors of H'H, the smaller of the two Gram matrices: four times
// faster than a singular value decomposition of H itself. Squaring costs precision only where it does not matter: an
// eigenvalue is right within 1e-15 s0^2, so the smallest singular value kept, about 5e-4 s0, is right within 1e-8 of
// itself, and the columns of U = H V S^-1 are orthonormal within 1e-9; both are below what single precision keeps.
// Where neighbouring eigenvectors mix, the filter hardly tells them apart either.
//
// The only file of the daemon that sees LAPACKE and CBLAS.
#include "daemon/solve/inverse.h"

#include <cblas.h>
#include <lapacke.h>

#include <algorithm>
#include <cmath>

namespace tractiond::solve {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// The lower triangle of A A' or, transposed, A' A.
MatrixXd gram(const MatrixXd& a, bool transposed) {
  const auto size = static_cast<int>(transposed ? a.cols() : a.rows());
  const auto inner = static_cast<int>(transposed ? a.rows() : a.cols());
  MatrixXd product(size, size);
  cblas_dsyrk(CblasColMajor, CblasLower, transposed ? CblasTrans : CblasNoTrans, size, inner, 1.0, a.data(),
              static_cast<int>(a.rows()), 0.0, product.data(), size);
  return product;
}

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

  MatrixXd vectors = gram(influence, true);
  report(0.1);
  VectorXd eigenvalues(forces);  // rising
  if (LAPACKE_dsyevd(LAPACK_COL_MAJOR, 'V', 'L', forces, vectors.data(), forces, eigenvalues.data()) != 0) {
    return tl::unexpected(Error{EX_SOFTWARE, "the influence matrix's eigenvectors were not found", "", ""});
  }
  report(0.7);

  Inverse inverse;
  const double largest = std::sqrt(eigenvalues[forces - 1]);
  inverse.lambda = options.regularisation * largest;
  const double smallest = std::max(options.truncation * inverse.lambda, 1e-7 * largest);
  for (int i = forces - 1; i >= 0 && eigenvalues[i] > smallest * smallest; --i) {
    inverse.singularValues.push_back(std::sqrt(eigenvalues[i]));
  }
  const auto rank = static_cast<int>(inverse.singularValues.size());
  const VectorXd s = VectorXd::Map(inverse.singularValues.data(), rank);
  const MatrixXd v = vectors.rightCols(rank).rowwise().reverse();
  vectors.resize(0, 0);

  MatrixXd u(coordinates, rank);
  cblas_dgemm(CblasColMajor, CblasNoTrans, CblasNoTrans, coordinates, rank, forces, 1.0, influence.data(), coordinates,
              v.data(), forces, 0.0, u.data(), coordinates);
  u *= s.cwiseInverse().asDiagonal();
  inverse.left = toRows(u);
  inverse.right = toRows(v.transpose());
  report(0.8);

  // With Q = U G^1/2, the hat matrix is Q Q'.
  u *= (s.array() / (s.array().square() + inverse.lambda * inverse.lambda).sqrt()).matrix().asDiagonal();
  const MatrixXd hat = gram(u, false);
  inverse.hat.reserve(static_cast<std::size_t>(coordinates) * (static_cast<std::size_t>(coordinates) + 1) / 2);
  for (int i = 0; i < coordinates; ++i) {
    for (int j = 0; j <= i; ++j) inverse.hat.push_back(static_cast<float>(hat(i, j)));
  }
  report(1.0);
  return inverse;
}

}  // namespace tractiond::solve
