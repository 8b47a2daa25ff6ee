// Written with the compilers' vector types of one cache line: on a machine with smaller registers the compiler splits
// each operation. Eight rows at a time share the loads and stores of the sum, so that what limits the speed is
// streaming the matrix itself.
#include "daemon/solve/kernels.h"

#include "daemon/base/vector_clones.h"

#include <sys/mman.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <new>

namespace tractiond::solve {
namespace {

using Line = float __attribute__((vector_size(64)));
using Doubles = double __attribute__((vector_size(64)));
constexpr int kDoubles = 8;
constexpr int kRows = 8;

#define TRACTION_INLINE __attribute__((always_inline)) inline

TRACTION_INLINE const Line* lines(const float* data) {
  return reinterpret_cast<const Line*>(data);
}

// Doubles lie anywhere. By reference, because how vectors are passed depends on the version of the function.
TRACTION_INLINE void load(const double* from, Doubles& vector) {
  std::memcpy(&vector, from, sizeof vector);
}

TRACTION_INLINE void store(const Doubles& vector, double* to) {
  std::memcpy(to, &vector, sizeof vector);
}

TRACTION_INLINE void add(const Line& part, double* sums) {
  Doubles low, high;
  load(sums, low);
  load(sums + kDoubles, high);
  low += __builtin_convertvector(__builtin_shufflevector(part, part, 0, 1, 2, 3, 4, 5, 6, 7), Doubles);
  high += __builtin_convertvector(__builtin_shufflevector(part, part, 8, 9, 10, 11, 12, 13, 14, 15), Doubles);
  store(low, sums);
  store(high, sums + kDoubles);
}

TRACTION_INLINE double dot(const double* a, const double* b, int size) {
  Doubles sums = {}, left, right;
  int i = 0;
  for (; i + kDoubles <= size; i += kDoubles) {
    load(a + i, left);
    load(b + i, right);
    sums += left * right;
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
  const std::ptrdiff_t lineCount = matrix.stride() / kLineFloats;
  int k = 0;
  for (; k + kRows <= count; k += kRows) {
    const Line* row[kRows];
    float c[kRows];
    for (int i = 0; i < kRows; ++i) {
      row[i] = lines(matrix.row(rows[k + i]));
      c[i] = coefficients[k + i];
    }
    for (std::ptrdiff_t j = 0; j < lineCount; ++j) {
      // Two chains, so that the additions of one line do not all wait for each other.
      Line even = c[0] * row[0][j], odd = c[1] * row[1][j];
      even += c[2] * row[2][j];
      odd += c[3] * row[3][j];
      even += c[4] * row[4][j];
      odd += c[5] * row[5][j];
      even += c[6] * row[6][j];
      odd += c[7] * row[7][j];
      add(even + odd, sum + kLineFloats * j);
    }
  }
  for (; k < count; ++k) {
    const Line* const row = lines(matrix.row(rows[k]));
    for (std::ptrdiff_t j = 0; j < lineCount; ++j) add(coefficients[k] * row[j], sum + kLineFloats * j);
  }
}

TRACTION_VECTOR_CLONES
void multiplyRows(const RowMatrix& matrix, std::span<const int> rows, const float* vector, double* products) {
  const std::ptrdiff_t lineCount = matrix.stride() / kLineFloats;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const Line* const row = lines(matrix.row(rows[k]));
    Line sums = {};
    for (std::ptrdiff_t j = 0; j < lineCount; ++j) sums += row[j] * lines(vector)[j];
    double sum = 0.0;
    for (int i = 0; i < kLineFloats; ++i) sum += static_cast<double>(sums[i]);
    products[k] = sum;
  }
}

TRACTION_VECTOR_CLONES
void multiplyRows(const RowMatrix& matrix, std::span<const int> rows, const double* vector, double* products) {
  const std::ptrdiff_t lineCount = matrix.stride() / kLineFloats;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const Line* const row = lines(matrix.row(rows[k]));
    Doubles low = {}, high = {}, left, right;
    for (std::ptrdiff_t j = 0; j < lineCount; ++j) {
      const Line part = row[j];
      load(vector + kLineFloats * j, left);
      load(vector + kLineFloats * j + kDoubles, right);
      low += left * __builtin_convertvector(__builtin_shufflevector(part, part, 0, 1, 2, 3, 4, 5, 6, 7), Doubles);
      high +=
          right * __builtin_convertvector(__builtin_shufflevector(part, part, 8, 9, 10, 11, 12, 13, 14, 15), Doubles);
    }
    low += high;
    products[k] = ((low[0] + low[1]) + (low[2] + low[3])) + ((low[4] + low[5]) + (low[6] + low[7]));
  }
}

TRACTION_VECTOR_CLONES
bool factoriseLower(std::span<double> lower, int size) {
  for (int i = 0; i < size; ++i) {
    double* const row = lower.data() + static_cast<std::ptrdiff_t>(i) * (i + 1) / 2;
    for (int j = 0; j < i; ++j) {
      const double* const other = lower.data() + static_cast<std::ptrdiff_t>(j) * (j + 1) / 2;
      row[j] = (row[j] - dot(other, row, j)) * other[j];
    }
    const double pivot = row[i] - dot(row, row, i);
    if (!(pivot > 0.0)) return false;
    row[i] = 1.0 / std::sqrt(pivot);
  }
  return true;
}

TRACTION_VECTOR_CLONES
void inverseDiagonal(std::span<const double> lower, int size, double* scratch, double* squares) {
  for (int column = 0; column < size; ++column) {
    scratch[column] = lower[static_cast<std::size_t>(column) * (column + 1) / 2 + column];
    for (int i = column + 1; i < size; ++i) {
      const double* const row = lower.data() + static_cast<std::ptrdiff_t>(i) * (i + 1) / 2;
      scratch[i] = -dot(row + column, scratch + column, i - column) * row[i];
    }
    squares[column] = dot(scratch + column, scratch + column, size - column);
  }
}

TRACTION_VECTOR_CLONES
double dotProduct(const double* a, const double* b, int size) {
  return dot(a, b, size);
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
    for (Doubles rest, part; j + kDoubles <= i; j += kDoubles) {
      load(vector + j, rest);
      load(row + j, part);
      rest -= x * part;
      store(rest, vector + j);
    }
    for (; j < i; ++j) vector[j] -= x * row[j];
  }
}

}  // namespace tractiond::solve
