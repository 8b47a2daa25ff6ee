#include "sensor/elastic/linear_algebra.h"

#include "sensor/elastic/parallel.h"

#include <cblas.h>

#include <algorithm>
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

/// The BLAS's own threads are not used: they wait for each other in a loop, serve one caller at a time, and divide a
/// product, and so round it, by their number.
[[maybe_unused]] const bool kAlone = (openblas_set_num_threads(1), true);

/// Calls task(first, count) for parts of the columns 0 .. columns - 1 of a result, at once where they are much work.
/// \param work multiplications for a column
template <typename Task>
void inColumns(Eigen::Index columns, double work, const Task& task) {
  constexpr double kWork = 3e7;  // of a part: a millisecond
  constexpr Eigen::Index kMost = 256;
  const auto enough = static_cast<Eigen::Index>(std::min(kWork / std::max(work, 1.0), 1e6));
  const Eigen::Index parts = std::max<Eigen::Index>(columns / std::max(enough, kMost), 1);
  inParallel(parts, [&](Eigen::Index part) {
    const Eigen::Index first = columns * part / parts;
    task(first, columns * (part + 1) / parts - first);
  });
}

}  // namespace

void multiply(double alpha, const ConstMatrixRef& a, Op opA, const ConstMatrixRef& b, Op opB, double beta,
              MatrixRef c) {
  const Eigen::Index inner = opA == Op::kPlain ? a.cols() : a.rows();
  assert((opA == Op::kPlain ? a.rows() : a.cols()) == c.rows() &&
         (opB == Op::kPlain ? b.cols() : b.rows()) == c.cols());
  assert((opB == Op::kPlain ? b.rows() : b.cols()) == inner);
  inColumns(c.cols(), static_cast<double>(c.rows()) * static_cast<double>(inner),
            [&](Eigen::Index first, Eigen::Index count) {
              const double* const from = b.data() + (opB == Op::kPlain ? first * b.outerStride() : first);
              cblas_dgemm(CblasColMajor, cblas(opA), cblas(opB), size(c.rows()), size(count), size(inner), alpha,
                          a.data(), stride(a.outerStride()), from, stride(b.outerStride()), beta,
                          c.data() + first * c.outerStride(), stride(c.outerStride()));
            });
}

void multiplyBySelf(double alpha, const ConstMatrixRef& a, Op op, double beta, MatrixRef c) {
  const Eigen::Index inner = op == Op::kPlain ? a.cols() : a.rows();
  assert(c.rows() == c.cols() && c.rows() == (op == Op::kPlain ? a.rows() : a.cols()));
  const Op other = op == Op::kPlain ? Op::kTransposed : Op::kPlain;
  inColumns(c.cols(), static_cast<double>(c.rows()) * static_cast<double>(inner) / 2.0,
            [&](Eigen::Index first, Eigen::Index count) {
              const auto from = [&](Eigen::Index i) { return a.data() + (op == Op::kPlain ? i : i * a.outerStride()); };
              double* const to = c.data() + first * (c.outerStride() + 1);
              const Eigen::Index below = c.rows() - first - count;
              cblas_dsyrk(CblasColMajor, CblasLower, cblas(op), size(count), size(inner), alpha, from(first),
                          stride(a.outerStride()), beta, to, stride(c.outerStride()));
              cblas_dgemm(CblasColMajor, cblas(op), cblas(other), size(below), size(count), size(inner), alpha,
                          from(first + count), stride(a.outerStride()), from(first), stride(a.outerStride()), beta,
                          to + count, stride(c.outerStride()));
            });
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
  inColumns(b.cols(), 0.5 * static_cast<double>(b.rows()) * static_cast<double>(b.rows()),
            [&](Eigen::Index first, Eigen::Index count) {
              cblas_dtrsm(CblasColMajor, CblasLeft, CblasLower, cblas(op), CblasNonUnit, size(b.rows()), size(count),
                          1.0, lower.data(), stride(lower.outerStride()), b.data() + first * b.outerStride(),
                          stride(b.outerStride()));
            });
}

void solveLowerRight(const ConstMatrixRef& lower, Op op, MatrixRef b) {
  assert(lower.rows() == lower.cols() && lower.rows() == b.cols());
  cblas_dtrsm(CblasColMajor, CblasRight, CblasLower, cblas(op), CblasNonUnit, size(b.rows()), size(b.cols()), 1.0,
              lower.data(), stride(lower.outerStride()), b.data(), stride(b.outerStride()));
}

}  // namespace sensor::elastic
