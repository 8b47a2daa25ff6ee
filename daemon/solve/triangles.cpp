// Cholesky factors and triangular solves. Eight right-hand sides at a time share the loads of the factor.
#include "base/vector_clones.h"
#include "daemon/solve/vectors.h"

#include <algorithm>
#include <cmath>

namespace tractiond::solve {
namespace {

template <typename Number>
TRACTION_INLINE Number* rowOf(Number* lower, int row) {
  return lower + static_cast<std::ptrdiff_t>(row) * (row + 1) / 2;
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

}  // namespace

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
  std::fill(columns + kColumns * first, columns + kColumns * size, 0.0);
  for (int k = 0; k < std::min(kColumns, size - first); ++k) columns[kColumns * (first + k) + k] = 1.0;
  solveColumns(lower.data(), first, size, columns);
}

TRACTION_VECTOR_CLONES
void solveLower(std::span<const double> lower, int size, double* vector) {
  for (int i = 0; i < size; ++i) {
    const double* const row = rowOf(lower.data(), i);
    vector[i] = (vector[i] - dot(row, vector, i)) * row[i];
  }
}

TRACTION_VECTOR_CLONES
void solveLowerColumns(std::span<const double> lower, int first, int size, double* columns) {
  solveColumns(lower.data(), first, size, columns);
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
