// Vectors of 32 bytes for the kernels' loops: a register of x86-64-v3. GCC keeps wider ones in memory where a register
// holds less, which costs a factor of ten. Included by the kernels' sources alone.
#pragma once

#include "daemon/solve/kernels.h"

#include <cstring>

namespace tractiond::solve {

using Floats = float __attribute__((vector_size(32)));
using Doubles = double __attribute__((vector_size(32)));
using FewFloats = float __attribute__((vector_size(16)));  // as many as Doubles
constexpr int kFloats = 8, kDoubles = 4;
/// A row of kColumns columns.
constexpr int kParts = 2;
static_assert(kColumns == kParts * kDoubles && kFloats == 2 * kDoubles && kLineFloats == 2 * kFloats);
/// Rows of kColumns sums that fit the registers.
constexpr int kTile = 4;

#define TRACTION_INLINE __attribute__((always_inline)) inline

// These read and write at addresses of any alignment. Vectors are passed by reference, because how they are passed by
// value depends on the version of the function.
/// Reads as many numbers as the vector holds.
template <typename Number, typename Vector>
TRACTION_INLINE void load(const Number* from, Vector& vector) {
  std::memcpy(&vector, from, sizeof vector);
}

/// Writes all numbers of the vector.
template <typename Vector>
TRACTION_INLINE void store(const Vector& vector, double* to) {
  std::memcpy(to, &vector, sizeof vector);
}

/// Reads as many floats as Doubles holds, and converts them.
TRACTION_INLINE void widen(const float* from, Doubles& vector) {
  FewFloats few;
  load(from, few);
  vector = __builtin_convertvector(few, Doubles);
}

/// Adds kFloats numbers to as many sums in memory.
TRACTION_INLINE void add(const Floats& part, double* sums) {
  const auto addHalf = [](const FewFloats& half, double* to) {
    Doubles sum;
    load(to, sum);
    store(sum + __builtin_convertvector(half, Doubles), to);
  };
  addHalf(__builtin_shufflevector(part, part, 0, 1, 2, 3), sums);
  addHalf(__builtin_shufflevector(part, part, 4, 5, 6, 7), sums + kDoubles);
}

/// Returns the sum of the vector's numbers.
TRACTION_INLINE double sumOf(const Doubles& numbers) {
  return (numbers[0] + numbers[1]) + (numbers[2] + numbers[3]);
}

/// Sets `sum` to the sums, by position in the vector, of the products a[i] b[i] of as many of the first numbers as fill
/// whole vectors. Returns how many these are, at most `size`.
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

/// Returns the scalar product of two arrays of `size` numbers.
TRACTION_INLINE double dot(const double* a, const double* b, int size) {
  Doubles sums;
  std::ptrdiff_t i = sumProducts(a, b, size, sums);
  double sum = sumOf(sums);
  for (; i < size; ++i) sum += a[i] * b[i];
  return sum;
}

/// Rows of kColumns numbers.
template <int count>
struct Tile {
  Doubles part[count][kParts] = {};
};

/// Computes tile += sum over first <= j < end of factor(i, j) times row j of `columns`, for each row i of the tile.
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

/// Computes A'B of two matrices, size x kColumns, row after row, into kColumns x kColumns products.
TRACTION_INLINE void columnProducts(const double* a, const double* b, int size, double* products) {
  for (int first = 0; first < kColumns; first += kTile) {
    Tile<kTile> sums;
    addProducts([=](int i, int j) { return a[kColumns * j + first + i]; }, 0, size, b, sums);
    for (int i = 0; i < kTile; ++i) {
      for (int p = 0; p < kParts; ++p) store(sums.part[i][p], products + kColumns * (first + i) + kDoubles * p);
    }
  }
}

}  // namespace tractiond::solve
