// Matrices that are streamed, and their products. Eight rows at a time share the loads and stores of the sum, so that
// what limits the speed is streaming the matrix itself.
#include "base/vector_clones.h"
#include "daemon/solve/vectors.h"

#include <sys/mman.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdlib>
#include <new>

namespace tractiond::solve {
namespace {

/// Rows that share the loads and stores of the sum.
constexpr std::size_t kRows = 8;

/// Fetches a short row, or what is read of one: the processor foresees long ones alone.
TRACTION_INLINE void prefetch(const float* row, std::ptrdiff_t length) {
  constexpr std::ptrdiff_t kShort = 20 * kLineFloats;
  if (length > kShort) return;
  for (std::ptrdiff_t j = 0; j < length; j += kLineFloats) __builtin_prefetch(row + j);
}

}  // namespace

template <typename Number>
LineArray<Number>::LineArray(std::size_t size, Pages pages)
    : size_(size) {
  constexpr std::size_t kLargePage = std::size_t{2} << 20, kSmallPage = std::size_t{4} << 10;
  constexpr std::size_t kLine = kLineFloats * sizeof(float);
  const std::size_t bytes = size * sizeof(Number), page = pages == Pages::kLarge ? kLargePage : kSmallPage;
  if (bytes < page) {
    const std::size_t rounded = std::max((bytes + kLine - 1) / kLine * kLine, kLine);
    auto* const data = static_cast<Number*>(std::aligned_alloc(kLine, rounded));  // NOLINT(*-no-malloc): aligned
    if (data == nullptr) throw std::bad_alloc();
    data_ = {data, Free{}};
    std::fill_n(data, size, Number{0});
    return;
  }
  // The system's pages are zero. Large ones save the page walks that streaming would otherwise wait for.
  const std::size_t length = bytes + page;
  void* const mapped = mmap(nullptr, length, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (mapped == MAP_FAILED) throw std::bad_alloc();
  std::size_t room = length;
  void* begin = mapped;
  std::align(page, bytes, begin, room);
#ifdef MADV_HUGEPAGE
  if (pages == Pages::kLarge) madvise(begin, bytes, MADV_HUGEPAGE);  // a wish; without it things still work
#endif
  data_ = {static_cast<Number*>(begin), Free{mapped, length}};
}

template <typename Number>
void LineArray<Number>::Free::operator()(Number* data) const {
  if (mapped != nullptr) {
    munmap(mapped, length);
  } else {
    std::free(data);  // NOLINT(*-no-malloc): of aligned_alloc
  }
}

template class LineArray<double>;
template class LineArray<float>;

RowMatrix::RowMatrix(int rows, int columns, Pages pages)
    : rows_(rows)
    , columns_(columns)
    , data_(rows * static_cast<std::size_t>(padded(columns)), pages) {}

void addRows(const RowMatrix& matrix, std::span<const int> rows, std::span<const float> coefficients, double* sum) {
  addColumns(matrix, rows, coefficients, 0, matrix.columns(), sum);
}

TRACTION_VECTOR_CLONES
void addColumns(const RowMatrix& matrix, std::span<const int> rows, std::span<const float> coefficients, int first,
                int end, double* sum) {
  const std::ptrdiff_t size = padded(end) - first;
  const auto row = [&](std::size_t k) { return matrix.row(rows[k]) + first; };
  const std::size_t count = rows.size();
  for (std::size_t k = 0; k < count; k += kRows) {
    const float* from[kRows];
    float c[kRows];
    for (std::size_t i = 0; i < kRows; ++i) {
      from[i] = row(std::min(k + i, count - 1));  // what fills the last group counts for nothing
      c[i] = k + i < count ? coefficients[k + i] : 0.0F;
      if (k + kRows + i < count) prefetch(row(k + kRows + i), size);
    }
    for (std::ptrdiff_t j = 0; j < size; j += kFloats) {
      Floats numbers, sums[2] = {};  // two chains, so that the additions of one line do not all wait for each other
#pragma GCC unroll 8
      for (std::size_t i = 0; i < kRows; ++i) {
        load(from[i] + j, numbers);
        sums[i % 2] += c[i] * numbers;
      }
      add(sums[0] + sums[1], sum + first + j);
    }
  }
}

void multiplyRows(const RowMatrix& matrix, std::span<const int> rows, const double* vector, double* products) {
  multiplyFirst(matrix, rows, matrix.columns(), vector, products);
}

TRACTION_VECTOR_CLONES
void multiplyFirst(const RowMatrix& matrix, std::span<const int> rows, int columns, const float* vector,
                   double* products) {
  for (std::size_t k = 0; k < rows.size(); ++k) {
    if (k + kRows < rows.size()) prefetch(matrix.row(rows[k + kRows]), padded(columns));
    Floats sums;
    sumProducts(matrix.row(rows[k]), vector, std::ptrdiff_t{padded(columns)}, sums);
    double sum = 0.0;
    for (int i = 0; i < kFloats; ++i) sum += static_cast<double>(sums[i]);
    products[k] = sum;
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
void sumSquares(std::span<const float> rows, int columns, const float* weights, double* sums) {
  const std::ptrdiff_t stride = padded(columns);
  for (const float* row = rows.data(); row != rows.data() + rows.size(); row += stride) {
    Floats sum[2] = {}, numbers, factors;
    for (std::ptrdiff_t j = 0; j < stride; j += kLineFloats) {
      for (int i = 0; i < 2; ++i) {
        load(row + j + kFloats * i, numbers);
        load(weights + j + kFloats * i, factors);
        sum[i] += factors * numbers * numbers;
      }
    }
    double all = 0.0;
    for (int i = 0; i < kFloats; ++i) all += static_cast<double>(sum[0][i] + sum[1][i]);
    *sums++ = all;
  }
}

TRACTION_VECTOR_CLONES
double dotProduct(const double* a, const double* b, int size) {
  return dot(a, b, size);
}

TRACTION_VECTOR_CLONES
void multiplyPairs(std::span<const double* const> columns, int first, int size, double* products, int stride) {
  constexpr int kLeft = 3, kRight = 4;  // columns that share their loads: as many sums as fit the registers
  const auto count = static_cast<int>(columns.size());
  for (int i = first; i < count; i += kLeft) {
    const int last = std::min(i + kLeft, count) - 1;
    const double* left[kLeft];
    for (int k = 0; k < kLeft; ++k) left[k] = columns[std::min(i + k, last)];
    for (int j = 0; j <= last; j += kRight) {
      const double* right[kRight];
      for (int k = 0; k < kRight; ++k) right[k] = columns[std::min(j + k, last)];
      Doubles sums[kLeft][kRight] = {}, a, b[kRight];
      for (std::ptrdiff_t at = 0; at < size; at += kDoubles) {
#pragma GCC unroll 4
        for (int k = 0; k < kRight; ++k) load(right[k] + at, b[k]);
#pragma GCC unroll 3
        for (int r = 0; r < kLeft; ++r) {
          load(left[r] + at, a);
#pragma GCC unroll 4
          for (int k = 0; k < kRight; ++k) sums[r][k] += a * b[k];
        }
      }
      for (int r = 0; i + r <= last; ++r) {
        for (int k = 0; k < kRight && j + k <= i + r; ++k) {
          products[static_cast<std::ptrdiff_t>(i + r) * stride + j + k] = sumOf(sums[r][k]);
        }
      }
    }
  }
}

TRACTION_VECTOR_CLONES
void addShares(std::span<const int> indices, std::span<const int> blockOf, const double* shares, const double* block,
               double* blocks) {
  constexpr int kBlock = 3 * kColumns, kBlockParts = kBlock / kDoubles;
  Doubles parts[kBlockParts], sum;
  for (int p = 0; p < kBlockParts; ++p) load(block + kDoubles * p, parts[p]);
  for (std::size_t k = 0; k < indices.size(); ++k) {
    double* const to = blocks + std::ptrdiff_t{kBlock} * blockOf[indices[k]];
    for (int p = 0; p < kBlockParts; ++p) {
      load(to + kDoubles * p, sum);
      store(sum + shares[k] * parts[p], to + kDoubles * p);
    }
  }
}

TRACTION_VECTOR_CLONES
void addForces(std::span<const int> indices, const double* forces, const double* block, double* rows) {
  for (const int index : indices) {
    for (int p = 0; p < kColumns; p += kDoubles) {
      Doubles sum, part;
      load(rows + std::ptrdiff_t{kColumns} * index + p, sum);
      for (int axis = 0; axis < 3; ++axis) {
        load(block + kColumns * axis + p, part);
        sum += forces[axis] * part;
      }
      store(sum, rows + std::ptrdiff_t{kColumns} * index + p);
    }
    forces += 3;
  }
}

TRACTION_VECTOR_CLONES
void multiplyBlocks(std::span<const int> indices, const double* roots, double* blocks) {
  for (const int index : indices) {
    const double* const root = roots + std::ptrdiff_t{9} * index;
    for (int p = 0; p < kColumns; p += kDoubles) {
      Doubles rows[3];
      for (int r = 0; r < 3; ++r) load(blocks + kColumns * r + p, rows[r]);
      for (int c = 0; c < 3; ++c) {
        Doubles sum = {};
        for (int r = c; r < 3; ++r) sum += root[3 * r + c] * rows[r];
        store(sum, blocks + kColumns * c + p);
      }
    }
    blocks += 3 * kColumns;
  }
}

TRACTION_VECTOR_CLONES
void addProducts(const double* column, const double* row, int size, double* columns) {
  Doubles right[kParts], sum;
  for (int p = 0; p < kParts; ++p) load(row + kDoubles * p, right[p]);
  for (std::ptrdiff_t k = 0; k < size; ++k) {
    for (int p = 0; p < kParts; ++p) {
      double* const to = columns + kColumns * k + kDoubles * p;
      load(to, sum);
      store(sum + column[k] * right[p], to);
    }
  }
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
        const float* const row = matrix.row(rows[k + std::min(i, count - 1)]) + first;
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

}  // namespace tractiond::solve
