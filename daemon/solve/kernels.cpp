// Written with the compilers' vector types of 32 bytes, a register of x86-64-v3: wider types GCC keeps in memory where
// a register holds less, which costs a factor of ten. Eight rows at a time share the loads and stores of the
// sum, so that what limits the speed is streaming the matrix itself.
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

using Floats = float __attribute__((vector_size(32)));
using Integers = std::int32_t __attribute__((vector_size(32)));
using Shorts = std::int16_t __attribute__((vector_size(16)));  // as many as Floats
using Doubles = double __attribute__((vector_size(32)));
using FewFloats = float __attribute__((vector_size(16)));  // as many as Doubles
constexpr int kFloats = 8, kDoubles = 4;
/// A row of kColumns columns.
constexpr int kParts = 2;
static_assert(kColumns == kParts * kDoubles && kFloats == 2 * kDoubles && kLineFloats == 2 * kFloats);
constexpr std::size_t kRows = 8;
/// Rows of kColumns sums that fit the registers.
constexpr int kTile = 4;

#define TRACTION_INLINE __attribute__((always_inline)) inline

// Doubles lie anywhere. By reference, because how vectors are passed depends on the version of the function.
template <typename Number, typename Vector>
TRACTION_INLINE void load(const Number* from, Vector& vector) {
  std::memcpy(&vector, from, sizeof vector);
}

template <typename Vector>
TRACTION_INLINE void store(const Vector& vector, double* to) {
  std::memcpy(to, &vector, sizeof vector);
}

/// Loads as many floats as there are Doubles.
TRACTION_INLINE void widen(const float* from, Doubles& vector) {
  FewFloats few;
  load(from, few);
  vector = __builtin_convertvector(few, Doubles);
}

TRACTION_INLINE void add(const Floats& part, double* sums) {
  const auto addHalf = [](const FewFloats& half, double* to) {
    Doubles sum;
    load(to, sum);
    store(sum + __builtin_convertvector(half, Doubles), to);
  };
  addHalf(__builtin_shufflevector(part, part, 0, 1, 2, 3), sums);
  addHalf(__builtin_shufflevector(part, part, 4, 5, 6, 7), sums + kDoubles);
}

TRACTION_INLINE void add(const Floats& part, float* sums) {
  Floats sum;
  load(sums, sum);
  sum += part;
  std::memcpy(sums, &sum, sizeof sum);
}

TRACTION_INLINE double sumOf(const Doubles& numbers) {
  return (numbers[0] + numbers[1]) + (numbers[2] + numbers[3]);
}

/// Adds up the products of as many numbers as fill whole vectors. Returns how many these are.
template <typename Number, typename Vector>
TRACTION_INLINE std::ptrdiff_t sumProducts(const Number* a, const Number* b, std::ptrdiff_t size, Vector& sum) {
  constexpr int kChains = 4;  // that do not wait for each other
  constexpr std::ptrdiff_t kNumbers = sizeof(Vector) / sizeof(Number);
  Vector sums[kChains] = {}, left, right;
  std::ptrdiff_t i = 0;
  for (; i + kChains * kNumbers <= size; i += kChains * kNumbers) {
#pragma GCC unroll 4
    for (int k = 0; k < kChains; ++k) {
      load(a + i + kNumbers * k, left);
      load(b + i + kNumbers * k, right);
      sums[k] += left * right;
    }
  }
  for (; i + kNumbers <= size; i += kNumbers) {
    load(a + i, left);
    load(b + i, right);
    sums[0] += left * right;
  }
  sum = (sums[0] + sums[1]) + (sums[2] + sums[3]);
  return i;
}

TRACTION_INLINE double dot(const double* a, const double* b, int size) {
  Doubles sums;
  std::ptrdiff_t i = sumProducts(a, b, size, sums);
  double sum = sumOf(sums);
  for (; i < size; ++i) sum += a[i] * b[i];
  return sum;
}

TRACTION_INLINE void read(const float* from, Floats& numbers) {
  load(from, numbers);
}

TRACTION_INLINE void read(const std::int16_t* from, Floats& numbers) {
  Shorts shorts;
  load(from, shorts);
  numbers = __builtin_convertvector(__builtin_convertvector(shorts, Integers), Floats);
}

/// Fetches a short row, or what is read of one: the processor foresees long ones alone.
template <typename Number>
TRACTION_INLINE void prefetch(const Number* row, std::ptrdiff_t length) {
  constexpr std::ptrdiff_t kLine = 64 / sizeof(Number), kShort = 20 * kLine;
  if (length > kShort) return;
  for (std::ptrdiff_t j = 0; j < length; j += kLine) __builtin_prefetch(row + j);
}

/// sum += sum over k < count of coefficient(k) * row(k), rows of `stride` numbers.
template <typename Row, typename Coefficient, typename Sum>
TRACTION_INLINE void addWeighed(int stride, std::size_t count, Row row, Coefficient coefficient, Sum* sum) {
  Floats numbers;
  std::size_t k = 0;
  for (; k + kRows <= count; k += kRows) {
    decltype(row(0)) from[kRows];
    float c[kRows];
    for (std::size_t i = 0; i < kRows; ++i) {
      from[i] = row(k + i);
      c[i] = coefficient(k + i);
      if (k + kRows + i < count) prefetch(row(k + kRows + i), stride);
    }
    for (std::ptrdiff_t j = 0; j < stride; j += kFloats) {
      Floats sums[2] = {};  // two chains, so that the additions of one line do not all wait for each other
#pragma GCC unroll 8
      for (std::size_t i = 0; i < kRows; ++i) {
        read(from[i] + j, numbers);
        sums[i % 2] += c[i] * numbers;
      }
      add(sums[0] + sums[1], sum + j);
    }
  }
  for (; k < count; ++k) {
    for (std::ptrdiff_t j = 0; j < stride; j += kFloats) {
      read(row(k) + j, numbers);
      add(coefficient(k) * numbers, sum + j);
    }
  }
}

/// Scalar product of a row of `stride` numbers.
TRACTION_INLINE double product(const float* row, const float* vector, std::ptrdiff_t stride) {
  Floats sums;
  sumProducts(row, vector, stride, sums);
  double sum = 0.0;
  for (int i = 0; i < kFloats; ++i) sum += static_cast<double>(sums[i]);
  return sum;
}

template <typename Number>
TRACTION_INLINE Number* rowOf(Number* lower, int row) {
  return lower + static_cast<std::ptrdiff_t>(row) * (row + 1) / 2;
}

/// Rows of kColumns numbers.
template <int count>
struct Tile {
  Doubles part[count][kParts] = {};
};

/// tile += sum over j < end of factor(i, j) times row j of `columns`, for each of its rows i.
template <int count, typename Factor>
TRACTION_INLINE void addProducts(Factor factor, int first, int end, const double* columns, Tile<count>& tile) {
  Doubles x[kParts];
  for (int j = first; j < end; ++j) {
#pragma GCC unroll 2
    for (int p = 0; p < kParts; ++p) load(columns + kColumns * j + kDoubles * p, x[p]);
#pragma GCC unroll 4
    for (int i = 0; i < count; ++i) {
      const double times = factor(i, j);
#pragma GCC unroll 2
      for (int p = 0; p < kParts; ++p) tile.part[i][p] += times * x[p];
    }
  }
}

/// Solves `count` rows of L Y = B in place, those from `first` to them being solved and 0 before.
template <int count>
TRACTION_INLINE void solveRows(const double* lower, int first, int at, double* columns) {
  const double* row[count];
  for (int i = 0; i < count; ++i) row[i] = rowOf(lower, at + i);
  Tile<count> sums;
  addProducts([&row](int i, int j) { return row[i][j]; }, first, at, columns, sums);
#pragma GCC unroll 4
  for (int i = 0; i < count; ++i) {
#pragma GCC unroll 2
    for (int p = 0; p < kParts; ++p) {
      Doubles x, other;
      load(columns + kColumns * (at + i) + kDoubles * p, x);
      x -= sums.part[i][p];
#pragma GCC unroll 4
      for (int j = 0; j < i; ++j) {
        load(columns + kColumns * (at + j) + kDoubles * p, other);
        x -= row[i][at + j] * other;
      }
      store(x * row[i][at + i], columns + kColumns * (at + i) + kDoubles * p);
    }
  }
}

/// Solves L Y = B in place for kColumns right-hand sides whose rows before `first` are zero.
TRACTION_INLINE void solveColumns(const double* lower, int first, int size, double* columns) {
  int i = first;
  for (; i + kTile <= size; i += kTile) solveRows<kTile>(lower, first, i, columns);
  for (; i < size; ++i) solveRows<1>(lower, first, i, columns);
}

/// kColumns columns of the inverse, or as many as there are, from the row `first` on.
TRACTION_INLINE void unitColumns(const double* lower, int first, int size, double* columns) {
  std::fill(columns + kColumns * first, columns + kColumns * size, 0.0);
  for (int k = 0; k < std::min(kColumns, size - first); ++k) columns[kColumns * (first + k) + k] = 1.0;
  solveColumns(lower, first, size, columns);
}

TRACTION_INLINE void columnProducts(const double* a, const double* b, int size, double* products) {
  for (int first = 0; first < kColumns; first += kTile) {
    Tile<kTile> sums;
    addProducts([=](int i, int j) { return a[kColumns * j + first + i]; }, 0, size, b, sums);
    for (int i = 0; i < kTile; ++i) {
      for (int p = 0; p < kParts; ++p) store(sums.part[i][p], products + kColumns * (first + i) + kDoubles * p);
    }
  }
}

}  // namespace

template <typename Number>
LineArray<Number>::LineArray(std::size_t size)
    : size_(size) {
  // Large pages save the page walks that streaming would otherwise wait for.
  constexpr std::size_t kLargePage = std::size_t{2} << 20;
  const std::size_t bytes = size * sizeof(Number);
  const std::size_t alignment = bytes >= kLargePage ? kLargePage : kLineFloats * sizeof(float);
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

void addRows(const RowMatrix& matrix, std::span<const int> rows, std::span<const float> coefficients, double* sum) {
  addColumns(matrix, rows, coefficients, 0, matrix.columns(), sum);
}

TRACTION_VECTOR_CLONES
void addColumns(const RowMatrix& matrix, std::span<const int> rows, std::span<const float> coefficients, int first,
                int end, double* sum) {
  const auto row = [&](std::size_t k) { return matrix.row(rows[k]) + first; };
  const auto coefficient = [&](std::size_t k) { return coefficients[k]; };
  addWeighed(padded(end) - first, rows.size(), row, coefficient, sum + first);
}

TRACTION_VECTOR_CLONES
void addRows(const CoarseMatrix& matrix, std::span<const int> rows, std::span<const float> coefficients, float* sum) {
  const auto row = [&](std::size_t k) { return matrix.row(rows[k]); };
  const auto coefficient = [&](std::size_t k) { return coefficients[k] * matrix.factor(rows[k]); };
  addWeighed(matrix.stride(), rows.size(), row, coefficient, sum);
}

void multiplyRows(const RowMatrix& matrix, std::span<const int> rows, const float* vector, double* products) {
  multiplyFirst(matrix, rows, matrix.columns(), vector, products);
}

void multiplyRows(const RowMatrix& matrix, std::span<const int> rows, const double* vector, double* products) {
  multiplyFirst(matrix, rows, matrix.columns(), vector, products);
}

TRACTION_VECTOR_CLONES
void multiplyFirst(const RowMatrix& matrix, std::span<const int> rows, int columns, const float* vector,
                   double* products) {
  for (std::size_t k = 0; k < rows.size(); ++k) {
    if (k + kRows < rows.size()) prefetch(matrix.row(rows[k + kRows]), padded(columns));
    products[k] = product(matrix.row(rows[k]), vector, padded(columns));
  }
}

TRACTION_VECTOR_CLONES
void multiplyFirst(const RowMatrix& matrix, std::span<const int> rows, int columns, const double* vector,
                   double* products) {
  constexpr int kChains = kLineFloats / kDoubles;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const float* const row = matrix.row(rows[k]);
    if (k + kRows < rows.size()) prefetch(matrix.row(rows[k + kRows]), padded(columns));
    Doubles sums[kChains] = {}, left, right;
    for (std::ptrdiff_t j = 0; j < padded(columns); j += kLineFloats) {
#pragma GCC unroll 4
      for (int i = 0; i < kChains; ++i) {
        widen(row + j + kDoubles * i, left);
        load(vector + j + kDoubles * i, right);
        sums[i] += left * right;
      }
    }
    products[k] = sumOf((sums[0] + sums[1]) + (sums[2] + sums[3]));
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
    double sums[kColumns] = {};
    for (int i = first; i < size; ++i) {
      for (int k = 0; k < kColumns; ++k) sums[k] += square(scratch[kColumns * i + k]);
    }
    std::copy_n(sums, count, squares + first);
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
  // Three rows at a time, of the components of a force, share the loads of the columns; converted a piece at a time, so
  // that their numbers are ready to be broadcast.
  constexpr int kShared = 3, kPiece = 128;
  const int size = matrix.columns();
  double piece[kShared][kPiece];
  for (int k = 0; k < std::ssize(rows); k += kShared) {
    const int count = std::min(kShared, static_cast<int>(std::ssize(rows)) - k);
    Tile<kShared> sums;
    for (int first = 0; first < size; first += kPiece) {
      const int length = std::min(kPiece, size - first);
      for (int i = 0; i < kShared; ++i) {
        const float* const row = matrix.row(rows[static_cast<std::size_t>(k + std::min(i, count - 1))]) + first;
        Doubles numbers;
        for (int j = 0; j < padded(length); j += kDoubles) {
          widen(row + j, numbers);
          store(numbers, piece[i] + j);
        }
      }
      addProducts([&piece](int i, int j) { return piece[i][j]; }, 0, length, columns + kColumns * first, sums);
    }
    for (int i = 0; i < count; ++i) {
      double* const to = products + static_cast<std::ptrdiff_t>(k + i) * stride;
      for (int p = 0; p < kParts; ++p) store(sums.part[i][p], to + kDoubles * p);
    }
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
