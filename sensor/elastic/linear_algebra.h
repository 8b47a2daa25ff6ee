// Double-precision operations on large dense matrices by BLAS and LAPACK (OpenBLAS), which choose their kernels for the
// machine at load time and use all its cores. Only this file calls them; small matrices use Eigen. Reentrant. Wrong
// sizes are asserted.
#pragma once

#include <Eigen/Core>

namespace sensor::elastic {

using MatrixRef = Eigen::Ref<Eigen::MatrixXd, 0, Eigen::OuterStride<>>;
using ConstMatrixRef = Eigen::Ref<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>;

enum class Op { kPlain, kTransposed };

/// Computes c = alpha op(a) op(b) + beta c.
void multiply(double alpha, const ConstMatrixRef& a, Op opA, const ConstMatrixRef& b, Op opB, double beta, MatrixRef c);

/// Computes the lower triangle of c = alpha op(a) op(a)^T + beta c.
void multiplyBySelf(double alpha, const ConstMatrixRef& a, Op op, double beta, MatrixRef c);

/// Replaces the lower triangle of `a` by its Cholesky factor. Returns false if `a` is not positive definite.
[[nodiscard]] bool factorise(MatrixRef a);

/// Replaces a symmetric matrix, of which only the lower triangle is read, by its eigenvectors; eigenvalues ascend.
/// Returns false if the iteration does not converge.
[[nodiscard]] bool eigenvectors(MatrixRef a, Eigen::VectorXd& eigenvalues);

/// Solves b = op(lower)^-1 b in place.
void solveLower(const ConstMatrixRef& lower, Op op, MatrixRef b);

/// Solves b = b op(lower)^-1 in place.
void solveLowerRight(const ConstMatrixRef& lower, Op op, MatrixRef b);

}  // namespace sensor::elastic
