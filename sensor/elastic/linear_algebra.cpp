#include "sensor/elastic/linear_algebra.h"

#include <cblas.h>

#include <cassert>

// LAPACK of OpenBLAS; the distribution's liblapack may be the slow reference implementation.
extern "C" {
void dpotrf_(const char* uplo, const int* n, double* a, const int* lda, int* info);
void dsyevd_(const char* job, const char* uplo, const int* n, double* a, const int* lda, double* eigenvalues,
             double* work, const int* workSize, int* integers, const int* integersSize, int* info);
}

namespace sensor::elastic {
namespace {

CBLAS_TRANSPOSE cblas(Op op) {
  return op == Op::kPlain ? CblasNoTrans : CblasTrans;
}
int size(Eigen::Index n) {
  return static_cast<int>(n);
}
// The BLAS requires strides of at least one, even for empty matrices.
int stride(Eigen::Index n) {
  return static_cast<int>(std::max<Eigen::Index>(n, 1));
}

}  // namespace

void multiply(double alpha, const ConstMatrixRef& a, Op opA, const ConstMatrixRef& b, Op opB, double beta,
              MatrixRef c) {
  const Eigen::Index inner = opA == Op::kPlain ? a.cols() : a.rows();
  assert((opA == Op::kPlain ? a.rows() : a.cols()) == c.rows() &&
         (opB == Op::kPlain ? b.cols() : b.rows()) == c.cols());
  assert((opB == Op::kPlain ? b.rows() : b.cols()) == inner);
  cblas_dgemm(CblasColMajor, cblas(opA), cblas(opB), size(c.rows()), size(c.cols()), size(inner), alpha, a.data(),
              stride(a.outerStride()), b.data(), stride(b.outerStride()), beta, c.data(), stride(c.outerStride()));
}

void multiplyBySelf(double alpha, const ConstMatrixRef& a, Op op, double beta, MatrixRef c) {
  assert(c.rows() == c.cols() && c.rows() == (op == Op::kPlain ? a.rows() : a.cols()));
  cblas_dsyrk(CblasColMajor, CblasLower, cblas(op), size(c.rows()), size(op == Op::kPlain ? a.cols() : a.rows()), alpha,
              a.data(), stride(a.outerStride()), beta, c.data(), stride(c.outerStride()));
}

bool factorise(MatrixRef a) {
  assert(a.rows() == a.cols());
  const int n = size(a.rows()), lda = stride(a.outerStride());
  int info = 0;
  dpotrf_("L", &n, a.data(), &lda, &info);
  return info == 0;
}

bool eigenvectors(MatrixRef a, Eigen::VectorXd& eigenvalues) {
  assert(a.rows() == a.cols());
  const int n = size(a.rows()), lda = stride(a.outerStride());
  eigenvalues.resize(n);
  double workSize = 0.0;
  int integersSize = 0, info = 0;
  constexpr int kAsk = -1;
  dsyevd_("V", "L", &n, a.data(), &lda, eigenvalues.data(), &workSize, &kAsk, &integersSize, &kAsk, &info);
  Eigen::VectorXd work(static_cast<Eigen::Index>(workSize));
  Eigen::VectorXi integers(integersSize);
  const int available = size(work.size());
  dsyevd_("V", "L", &n, a.data(), &lda, eigenvalues.data(), work.data(), &available, integers.data(), &integersSize,
          &info);
  return info == 0;
}

void solveLower(const ConstMatrixRef& lower, Op op, MatrixRef b) {
  assert(lower.rows() == lower.cols() && lower.rows() == b.rows());
  cblas_dtrsm(CblasColMajor, CblasLeft, CblasLower, cblas(op), CblasNonUnit, size(b.rows()), size(b.cols()), 1.0,
              lower.data(), stride(lower.outerStride()), b.data(), stride(b.outerStride()));
}

void solveLowerRight(const ConstMatrixRef& lower, Op op, MatrixRef b) {
  assert(lower.rows() == lower.cols() && lower.rows() == b.cols());
  cblas_dtrsm(CblasColMajor, CblasRight, CblasLower, cblas(op), CblasNonUnit, size(b.rows()), size(b.cols()), 1.0,
              lower.data(), stride(lower.outerStride()), b.data(), stride(b.outerStride()));
}

}  // namespace sensor::elastic
