// Double-precision operations on large dense matrices by BLAS and LAPACK (OpenBLAS), which choose their kernels for the
// machine at load time. Only this file calls them; small matrices use Eigen. Large products are divided among the
// machine's cores; their results do not depend on how many there are. Reentrant. Wrong sizes are asserted.
#pragma once

#include <Eigen/Core>

namespace sensor::elastic {

using MatrixRef = Eigen::Ref<Eigen::MatrixXd, 0, Eigen::OuterStride<>>;
using ConstMatrixRef = Eigen::Ref<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>;

enum class Op { kPlain, kTransposed };

/// Computes c = alpha op(a) op(b) + beta c. `c` must not overlap `a` or `b`.
void multiply(double alpha, const ConstMatrixRef& a, Op opA, const ConstMatrixRef& b, Op opB, double beta, MatrixRef c);

/// Computes the lower triangle of c = alpha op(a) op(a)^T + beta c; the rest of c is left unchanged.
void multiplyBySelf(double alpha, const ConstMatrixRef& a, Op op, double beta, MatrixRef c);

/// Replaces the lower triangle of `a` by its Cholesky factor L, a = L L^T; the rest is neither read nor changed.
/// Returns false if `a` is not positive definite; its lower triangle then has no meaning.
[[nodiscard]] bool factorise(MatrixRef a);

/// Replaces the lower triangle of a positive semidefinite matrix by the columns of its Cholesky factor with pivots
/// above `tolerance`, and returns their number: a(pivots, pivots) = L L^T. What is right of them has no meaning.
int factorisePivoted(double tolerance, Eigen::MatrixXd& a, Eigen::VectorXi& pivots);

/// Replaces a symmetric matrix, of which only the lower triangle is read, by its orthonormal eigenvectors with
/// eigenvalues above `least`, one per column; the eigenvalues, which are resized, ascend. Returns false if the
/// iteration does not converge; the results then have no meaning.
[[nodiscard]] bool eigenvectorsAbove(double least, Eigen::MatrixXd& a, Eigen::VectorXd& eigenvalues);

/// Replaces b by op(lower)^-1 b. Only the lower triangle of `lower` is read; its diagonal must not contain 0.
void solveLower(const ConstMatrixRef& lower, Op op, MatrixRef b);

/// Replaces b by b op(lower)^-1, in the same way.
void solveLowerRight(const ConstMatrixRef& lower, Op op, MatrixRef b);

}  // namespace sensor::elastic
