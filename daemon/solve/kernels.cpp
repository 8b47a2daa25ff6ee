// Written with the compilers' vector types of one cache line: on a machine with smaller registers the compiler splits
// each operation. Eight rows at a time share the loads and stores of the sum, so that what limits the speed is
// streaming the matrix itself.
#include "daemon/solve/kernels.h"

#include "daemon/base/vector_clones.h"

#include <sys/mman.h>

#include <algorithm>
#include <cstdlib>
#include <new>

namespace tractiond::solve {
namespace {

using Line = float __attribute__((vector_size(64)));
using Doubles = double __attribute__((vector_size(64), aligned(8), may_alias));  // eight, anywhere
constexpr int kDoubles = 8;
constexpr int kRows = 8;

#define TRACTION_INLINE __attribute__((always_inline)) inline
#define TRACTION_INLINE_LAMBDA __attribute__((always_inline))

TRACTION_INLINE const Line* lines(const float* data) {
  return reinterpret_cast<const Line*>(data);
}

TRACTION_INLINE double dot(const double* a, const double* b, int size) {
  Doubles sums = {};
  int i = 0;
  for (; i + kDoubles <= size; i += kDoubles) {
    sums += *reinterpret_cast<const Doubles*>(a + i) * *reinterpret_cast<const Doubles*>(b + i);
  }
  double sum = ((sums[0] + sums[1]) + (sums[2] + sums[3])) + ((sums[4] + sums[5]) + (sums[6] + sums[7]));
  for (; i < size; ++i) sum += a[i] * b[i];
  return sum;
}

}  // namespace

RowMatrix::RowMatrix(int rows, int columns)
    : rows_(rows)
    , columns_(columns) {
  // Large pages save the page walks that streaming would otherwise wait for.
  constexpr std::size_t kLargePage = std::size_t{2} << 20;
  const std::size_t bytes = all().size_bytes();
  const std::size_t alignment = bytes >= kLargePage ? kLargePage : sizeof(Line);
  const std::size_t rounded = std::max((bytes + alignment - 1) / alignment * alignment, alignment);
  data_.reset(static_cast<float*>(std::aligned_alloc(alignment, rounded)));
  if (!data_) throw std::bad_alloc();
#ifdef MADV_HUGEPAGE
  if (alignment == kLargePage) madvise(data_.get(), rounded, MADV_HUGEPAGE);  // a wish; without it things still work
#endif
  std::fill_n(data_.get(), all().size(), 0.0F);
}

void RowMatrix::Free::operator()(float* data) const {
  std::free(data);
}

TRACTION_VECTOR_CLONES
void addRows(const RowMatrix& matrix, std::span<const int> rows, std::span<const float> coefficients, double* sum) {
  const int count = static_cast<int>(rows.size());
  const int lineCount = matrix.stride() / kLineFloats;
  Doubles* const sums = reinterpret_cast<Doubles*>(sum);
  const auto add = [sums](int line, Line part) TRACTION_INLINE_LAMBDA {
    sums[2 * line] += __builtin_convertvector(__builtin_shufflevector(part, part, 0, 1, 2, 3, 4, 5, 6, 7), Doubles);
    sums[2 * line + 1] +=
        __builtin_convertvector(__builtin_shufflevector(part, part, 8, 9, 10, 11, 12, 13, 14, 15), Doubles);
  };
  int k = 0;
  for (; k + kRows <= count; k += kRows) {
    const Line* row[kRows];
    float c[kRows];
    for (int i = 0; i < kRows; ++i) {
      row[i] = lines(matrix.row(rows[k + i]));
      c[i] = coefficients[k + i];
    }
    for (int j = 0; j < lineCount; ++j) {
      // Two chains, so that the additions of one line do not all wait for each other.
      Line even = c[0] * row[0][j], odd = c[1] * row[1][j];
      even += c[2] * row[2][j];
      odd += c[3] * row[3][j];
      even += c[4] * row[4][j];
      odd += c[5] * row[5][j];
      even += c[6] * row[6][j];
      odd += c[7] * row[7][j];
      add(j, even + odd);
    }
  }
  for (; k < count; ++k) {
    const Line* const row = lines(matrix.row(rows[k]));
    for (int j = 0; j < lineCount; ++j) add(j, coefficients[k] * row[j]);
  }
}

TRACTION_VECTOR_CLONES
void multiplyRows(const RowMatrix& matrix, std::span<const int> rows, const float* vector, double* products) {
  const int lineCount = matrix.stride() / kLineFloats;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const Line* const row = lines(matrix.row(rows[k]));
    Line sums = {};
    for (int j = 0; j < lineCount; ++j) sums += row[j] * lines(vector)[j];
    double sum = 0.0;
    for (int i = 0; i < kLineFloats; ++i) sum += static_cast<double>(sums[i]);
    products[k] = sum;
  }
}

TRACTION_VECTOR_CLONES
void solveLower(std::span<const double> lower, int size, double* vector) {
  for (int i = 0; i < size; ++i) {
    const double* const row = lower.data() + static_cast<std::ptrdiff_t>(i) * (i + 1) / 2;
    vector[i] = (vector[i] - dot(row, vector, i)) * row[i];
  }
}

TRACTION_VECTOR_CLONES
void solveLowerTransposed(std::span<const double> lower, int size, double* vector) {
  for (int i = size - 1; i >= 0; --i) {
    const double* const row = lower.data() + static_cast<std::ptrdiff_t>(i) * (i + 1) / 2;
    const double x = vector[i] *= row[i];
    int j = 0;
    for (; j + kDoubles <= i; j += kDoubles) {
      *reinterpret_cast<Doubles*>(vector + j) -= x * *reinterpret_cast<const Doubles*>(row + j);
    }
    for (; j < i; ++j) vector[j] -= x * row[j];
  }
}

}  // namespace tractiond::solve
