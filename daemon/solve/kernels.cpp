// Written with the compilers' vector types of one cache line: on a machine with smaller registers the compiler splits
// each operation. Eight rows at a time share the loads and stores of the sum, so that what limits the speed is
// streaming the matrix itself.
#include "daemon/solve/kernels.h"

#include "base/vector_clones.h"

#include <sys/mman.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <new>

namespace tractiond::solve {
namespace {

using Line = float __attribute__((vector_size(64)));
using Integers = std::int32_t __attribute__((vector_size(64)));
using Shorts = std::int16_t __attribute__((vector_size(32)));  // as many as floats in a Line
using Doubles = double __attribute__((vector_size(64)));
constexpr int kDoubles = 8;
static_assert(kColumns == kDoubles);
constexpr std::size_t kRows = 8;

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

TRACTION_INLINE void add(const Line& part, float* sums) {
  *reinterpret_cast<Line*>(sums) += part;
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

TRACTION_INLINE void asLine(const Line& numbers, Line& line) {
  line = numbers;
}

TRACTION_INLINE void asLine(const Shorts& numbers, Line& line) {
  line = __builtin_convertvector(__builtin_convertvector(numbers, Integers), Line);
}

/// sum += sum over k < count of coefficient(k) * row(k), rows of `stride` numbers.
template <typename Row, typename Coefficient, typename Sum>
TRACTION_INLINE void addWeighed(int stride, std::size_t count, Row row, Coefficient coefficient, Sum* sum) {
  const std::ptrdiff_t lineCount = stride / kLineFloats;
  Line numbers;
  std::size_t k = 0;
  for (; k + kRows <= count; k += kRows) {
    decltype(row(0)) from[kRows];
    float c[kRows];
    for (std::size_t i = 0; i < kRows; ++i) {
      from[i] = row(k + i);
      c[i] = coefficient(k + i);
    }
    for (std::ptrdiff_t j = 0; j < lineCount; ++j) {
      Line sums[2] = {};  // two chains, so that the additions of one line do not all wait for each other
#pragma GCC unroll 8
      for (std::size_t i = 0; i < kRows; ++i) {
        asLine(from[i][j], numbers);
        sums[i % 2] += c[i] * numbers;
      }
      add(sums[0] + sums[1], sum + kLineFloats * j);
    }
  }
  for (; k < count; ++k) {
    for (std::ptrdiff_t j = 0; j < lineCount; ++j) {
      asLine(row(k)[j], numbers);
      add(coefficient(k) * numbers, sum + kLineFloats * j);
    }
  }
}

template <typename Number>
TRACTION_INLINE Number* rowOf(Number* lower, int row) {
  return lower + static_cast<std::ptrdiff_t>(row) * (row + 1) / 2;
}

/// Solves L Y = B in place for kColumns right-hand sides whose rows before `first` are zero.
TRACTION_INLINE void solveColumns(const double* lower, int first, int size, double* columns) {
  for (int i = first; i < size; ++i) {
    const double* const row = rowOf(lower, i);
    Doubles sums[4] = {}, x;
    int j = first;
    for (; j + 4 <= i; j += 4) {
#pragma GCC unroll 4
      for (int k = 0; k < 4; ++k) {
        load(columns + kColumns * (j + k), x);
        sums[k] += row[j + k] * x;
      }
    }
    for (; j < i; ++j) {
      load(columns + kColumns * j, x);
      sums[0] += row[j] * x;
    }
    load(columns + kColumns * i, x);
    x = (x - ((sums[0] + sums[1]) + (sums[2] + sums[3]))) * row[i];
    store(x, columns + kColumns * i);
  }
}

/// kColumns columns of the inverse, or as many as there are, from the row `first` on.
TRACTION_INLINE void unitColumns(const double* lower, int first, int size, double* columns) {
  std::fill(columns + kColumns * first, columns + kColumns * size, 0.0);
  for (int k = 0; k < std::min(kColumns, size - first); ++k) columns[kColumns * (first + k) + k] = 1.0;
  solveColumns(lower, first, size, columns);
}

TRACTION_INLINE void columnProducts(const double* a, const double* b, int size, double* products) {
  Doubles sums[kColumns] = {}, x;
  for (int i = 0; i < size; ++i) {
    load(b + kColumns * i, x);
#pragma GCC unroll 8
    for (int k = 0; k < kColumns; ++k) sums[k] += a[kColumns * i + k] * x;
  }
  for (int k = 0; k < kColumns; ++k) store(sums[k], products + kColumns * k);
}

}  // namespace

template <typename Number>
LineArray<Number>::LineArray(std::size_t size)
    : size_(size) {
  // Large pages save the page walks that streaming would otherwise wait for.
  constexpr std::size_t kLargePage = std::size_t{2} << 20;
  const std::size_t bytes = size * sizeof(Number);
  const std::size_t alignment = bytes >= kLargePage ? kLargePage : sizeof(Line);
  const std::size_t rounded = std::max((bytes + alignment - 1) / alignment * alignment, alignment);
  data_.reset(static_cast<Number*>(std::aligned_alloc(alignment, rounded)));  // NOLINT(*-no-malloc): of any alignment
  if (!data_) throw std::bad_alloc();
#ifdef MADV_HUGEPAGE
  if (alignment == kLargePage) madvise(data_.get(), rounded, MADV_HUGEPAGE);  // a wish; without it things still work
#endif
  std::fill_n(data_.get(), size, Number{0});
}

template <typename Number>
void LineArray<Number>::Free::operator()(Number* data) const {
  std::free(data);  // NOLINT(*-no-malloc): of aligned_alloc
}

template class LineArray<double>;
template class LineArray<float>;
template class LineArray<std::int16_t>;

RowMatrix::RowMatrix(int rows, int columns)
    : rows_(rows)
    , columns_(columns)
    , data_(static_cast<std::size_t>(rows) * static_cast<std::size_t>(padded(columns))) {}

CoarseMatrix::CoarseMatrix(const RowMatrix& matrix, int rows, int columns)
    : columns_(columns)
    , data_(static_cast<std::size_t>(rows) * static_cast<std::size_t>(padded(columns))) {
  assert(rows <= matrix.rows() && columns <= matrix.columns());
  for (int i = 0; i < rows; ++i) {
    const std::span<const float> from(matrix.row(i), static_cast<std::size_t>(columns));
    float largest = 0.0F;
    for (const float x : from) largest = std::max(largest, std::abs(x));
    factors_.push_back(largest / std::numeric_limits<std::int16_t>::max());
    if (largest == 0.0F) continue;
    std::int16_t* const to = data_.data() + static_cast<std::ptrdiff_t>(i) * stride();
    for (int j = 0; j < columns; ++j) to[j] = static_cast<std::int16_t>(std::lround(from[j] / factors_.back()));
  }
}

TRACTION_VECTOR_CLONES
void addRows(const RowMatrix& matrix, std::span<const int> rows, std::span<const float> coefficients, double* sum) {
  const auto row = [&](std::size_t k) { return lines(matrix.row(rows[k])); };
  const auto coefficient = [&](std::size_t k) { return coefficients[k]; };
  addWeighed(matrix.stride(), rows.size(), row, coefficient, sum);
}

TRACTION_VECTOR_CLONES
void addRows(const CoarseMatrix& matrix, std::span<const int> rows, std::span<const float> coefficients, float* sum) {
  const auto row = [&](std::size_t k) { return reinterpret_cast<const Shorts*>(matrix.row(rows[k])); };
  const auto coefficient = [&](std::size_t k) { return coefficients[k] * matrix.factor(rows[k]); };
  addWeighed(matrix.stride(), rows.size(), row, coefficient, sum);
}

TRACTION_VECTOR_CLONES
void multiplyRows(const RowMatrix& matrix, std::span<const int> rows, const float* vector, double* products) {
  const std::ptrdiff_t lineCount = matrix.stride() / kLineFloats;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const Line* const row = lines(matrix.row(rows[k]));
    Line sums[4] = {};  // chains that do not wait for each other
    std::ptrdiff_t j = 0;
    for (; j + 4 <= lineCount; j += 4) {
#pragma GCC unroll 4
      for (int i = 0; i < 4; ++i) sums[i] += row[j + i] * lines(vector)[j + i];
    }
    for (; j < lineCount; ++j) sums[0] += row[j] * lines(vector)[j];
    sums[0] = (sums[0] + sums[1]) + (sums[2] + sums[3]);
    double sum = 0.0;
    for (int i = 0; i < kLineFloats; ++i) sum += static_cast<double>(sums[0][i]);
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
bool factoriseLower(std::span<double> lower, int size, double* scratch) {
  // Eight rows at a time: what stands left of their diagonal block is a triangular solve with eight right-hand sides.
  for (int first = 0; first < size; first += kColumns) {
    const int count = std::min(kColumns, size - first);
    double* row[kColumns];
    for (int k = 0; k < count; ++k) row[k] = rowOf(lower.data(), first + k);
    for (int j = 0; j < first; ++j) {
      for (int k = 0; k < kColumns; ++k) scratch[kColumns * j + k] = k < count ? row[k][j] : 0.0;
    }
    solveColumns(lower.data(), 0, first, scratch);
    for (int j = 0; j < first; ++j) {
      for (int k = 0; k < count; ++k) row[k][j] = scratch[kColumns * j + k];
    }
    double products[kColumns * kColumns];
    columnProducts(scratch, scratch, first, products);
    for (int i = 0; i < count; ++i) {
      double* const block = row[i] + first;
      for (int j = 0; j <= i; ++j) {
        double rest = block[j] - products[kColumns * i + j];
        for (int k = 0; k < j; ++k) rest -= block[k] * row[j][first + k];
        if (j < i) {
          block[j] = rest * row[j][first + j];
        } else if (rest > 0.0) {
          block[j] = 1.0 / std::sqrt(rest);
        } else {
          return false;
        }
      }
    }
  }
  return true;
}

TRACTION_VECTOR_CLONES
void inverseColumns(std::span<const double> lower, int first, int size, double* columns) {
  unitColumns(lower.data(), first, size, columns);
}

TRACTION_VECTOR_CLONES
void inverseDiagonal(std::span<const double> lower, int size, double* scratch, double* squares) {
  for (int first = 0; first < size; first += kColumns) {
    const int count = std::min(kColumns, size - first);
    unitColumns(lower.data(), first, size, scratch);
    Doubles sums = {}, x;
    for (int i = first; i < size; ++i) {
      load(scratch + kColumns * i, x);
      sums += x * x;
    }
    for (int k = 0; k < count; ++k) squares[first + k] = sums[k];
  }
}

TRACTION_VECTOR_CLONES
double dotProduct(const double* a, const double* b, int size) {
  return dot(a, b, size);
}

TRACTION_VECTOR_CLONES
void solveLower(std::span<const double> lower, int size, double* vector) {
  for (int i = 0; i < size; ++i) {
    const double* const row = rowOf(lower.data(), i);
    vector[i] = (vector[i] - dot(row, vector, i)) * row[i];
  }
}

TRACTION_VECTOR_CLONES
void solveLowerColumns(std::span<const double> lower, int size, double* columns) {
  solveColumns(lower.data(), 0, size, columns);
}

TRACTION_VECTOR_CLONES
void multiplyColumns(const double* a, const double* b, int size, double* products) {
  columnProducts(a, b, size, products);
}

TRACTION_VECTOR_CLONES
void multiplyRowsByColumns(const RowMatrix& matrix, std::span<const int> rows, const double* columns, double* products,
                           int stride) {
  // Three rows at a time, of the components of a force, share the loads of the columns.
  constexpr std::size_t kShared = 3;
  Doubles x;
  for (std::size_t k = 0; k < rows.size(); k += kShared) {
    const std::size_t count = std::min(kShared, rows.size() - k);
    const float* row[kShared];
    for (std::size_t i = 0; i < kShared; ++i) row[i] = matrix.row(rows[k + std::min(i, count - 1)]);
    Doubles sums[kShared] = {};
    for (int j = 0; j < matrix.columns(); ++j) {
      load(columns + kColumns * j, x);
#pragma GCC unroll 3
      for (std::size_t i = 0; i < kShared; ++i) sums[i] += static_cast<double>(row[i][j]) * x;
    }
    for (std::size_t i = 0; i < count; ++i) store(sums[i], products + static_cast<std::ptrdiff_t>(k + i) * stride);
  }
}

TRACTION_VECTOR_CLONES
void solveLowerTransposed(std::span<const double> lower, int size, double* vector) {
  for (int i = size - 1; i >= 0; --i) {
    const double* const row = rowOf(lower.data(), i);
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
