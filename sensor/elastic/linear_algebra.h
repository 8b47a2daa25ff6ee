// Dense double precision products, Cholesky factors, triangular solves and eigenvectors of large matrices by the BLAS
// and LAPACK (OpenBLAS), which choose their kernels for the machine at load time and use its cores. The only door to
// them. Small matrices stay with Eigen. Reentrant.
#pragma once

#include <Eigen/Core>

namespace sensor::elastic {

using MatrixRef = Eigen::Ref<Eigen::MatrixXd, 0, Eigen::OuterStride<>>;
using ConstMatrixRef = Eigen::Ref<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>;

enum class Op { kPlain, kTransposed };

/// c = alpha op(a) op(b) + beta c.
void multiply(double alpha, const ConstMatrixRef& a, Op opA, const ConstMatrixRef& b, Op opB, double beta, MatrixRef c);

/// c = alpha op(a) op(a)^T + beta c, lower triangle alone.
void multiplyBySelf(double alpha, const ConstMatrixRef& a, Op op, double beta, MatrixRef c);

/// Lower Cholesky factor in place; reads and writes the lower triangle. False if `a` is not positive definite.
[[nodiscard]] bool factorise(MatrixRef a);

/// Eigenvectors of a symmetric matrix in place, and its eigenvalues, rising; reads the lower triangle. False if the
/// iteration does not converge.
[[nodiscard]] bool eigenvectors(MatrixRef a, Eigen::VectorXd& eigenvalues);

/// b = op(lower)^-1 b.
void solveLower(const ConstMatrixRef& lower, Op op, MatrixRef b);

/// b = b op(lower)^-1.
void solveLowerRight(const ConstMatrixRef& lower, Op op, MatrixRef b);

}  // namespace sensor::elastic
