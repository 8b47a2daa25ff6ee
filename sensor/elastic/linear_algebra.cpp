#include "sensor/elastic/linear_algebra.h"

#include "sensor/elastic/parallel.h"

#include <cblas.h>

#include <algorithm>
#include <cassert>
#include <utility>

// LAPACK of OpenBLAS; the distribution's liblapack may be the slow reference implementation.
extern "C" {
void dpotrf_(const char* uplo, const int* n, double* a, const int* lda, int* info);
void dpstrf_(const char* uplo, const int* n, double* a, const int* lda, int* pivots, int* rank, const double* tolerance,
             double* work, int* info);
void dsytrd_(const char* uplo, const int* n, double* a, const int* lda, double* diagonal, double* beside,
             double* reflectors, double* work, const int* workSize, int* info);
void dstemr_(const char* job, const char* range, const int* n, double* diagonal, double* beside, const double* low,
             const double* high, const int* first, const int* last, int* found, double* eigenvalues, double* vectors,
             const int* ldz, const int* most, int* support, int* tryRelative, double* work, const int* workSize,
             int* integers, const int* integersSize, int* info);
void dormtr_(const char* side, const char* uplo, const char* op, const int* rows, const int* columns, const double* a,
             const int* lda, const double* reflectors, double* c, const int* ldc, double* work, const int* workSize,
             int* info);
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

int factorisePivoted(double tolerance, Eigen::MatrixXd& a, Eigen::VectorXi& pivots) {
  assert(a.rows() == a.cols());
  const int n = size(a.rows()), lda = stride(a.rows());
  int rank = 0, info = 0;
  Eigen::VectorXd work(2 * n);
  pivots.resize(n);
  dpstrf_("L", &n, a.data(), &lda, pivots.data(), &rank, &tolerance, work.data(), &info);
  assert(info >= 0);
  pivots.array() -= 1;
  return rank;
}

// By the tridiagonal matrix of Householder's reflections, which are undone only for the eigenvectors that are asked
// for.
bool eigenvectorsAbove(double least, Eigen::MatrixXd& a, Eigen::VectorXd& eigenvalues) {
  assert(a.rows() == a.cols());
  constexpr int kBlock = 64;  // columns that are reflected together
  const int n = size(a.rows()), space = kBlock * stride(n), most = 10 * n;
  Eigen::VectorXd diagonal(n), beside(n), reflectors(n), work(space);
  Eigen::VectorXi support(2 * n), integers(most);
  Eigen::MatrixXd vectors(n, n);
  int info = 0, found = 0, tryRelative = 1;
  dsytrd_("L", &n, a.data(), &n, diagonal.data(), beside.data(), reflectors.data(), work.data(), &space, &info);
  if (info != 0) return false;
  eigenvalues.resize(n);
  // All of them: to find those in a range by bisection takes longer.
  dstemr_("V", "A", &n, diagonal.data(), beside.data(), nullptr, nullptr, nullptr, nullptr, &found, eigenvalues.data(),
          vectors.data(), &n, &n, support.data(), &tryRelative, work.data(), &space, integers.data(), &most, &info);
  if (info != 0) return false;
  const auto above = (eigenvalues.array() > least).count();
  eigenvalues = eigenvalues.tail(above).eval();
  vectors = vectors.rightCols(above).eval();
  inColumns(above, 2.0 * n * n, [&](Eigen::Index first, Eigen::Index count) {
    const int columns = size(count), own = kBlock * stride(count);
    Eigen::VectorXd scratch(own);
    [[maybe_unused]] int failed = 0;
    dormtr_("L", "L", "N", &n, &columns, a.data(), &n, reflectors.data(), vectors.data() + first * n, &n,
            scratch.data(), &own, &failed);
    assert(failed == 0);
  });
  a = std::move(vectors);
  return true;
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
