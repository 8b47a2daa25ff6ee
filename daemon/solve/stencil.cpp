#include "daemon/solve/stencil.h"

#include "base/vector_clones.h"

#include <algorithm>
#include <cmath>

namespace tractiond::solve {
namespace {

/// Cubics through 0, 1, 2, 3 that are 1 at one of them and 0 at the others, and their first three derivatives, at s.
using Cubics = std::array<std::array<double, 4>, 4>;  // of each derivative, of each node
Cubics cubics(double s) {
  constexpr double kCoefficients[4][4] = {{1.0, -11.0 / 6.0, 1.0, -1.0 / 6.0},
                                          {0.0, 3.0, -2.5, 0.5},
                                          {0.0, -1.5, 2.0, -0.5},
                                          {0.0, 1.0 / 3.0, -0.5, 1.0 / 6.0}};
  Cubics result;
  for (std::size_t node = 0; node < 4; ++node) {
    const auto& c = kCoefficients[node];
    result[0][node] = c[0] + s * (c[1] + s * (c[2] + s * c[3]));
    result[1][node] = c[1] + s * (2.0 * c[2] + s * 3.0 * c[3]);
    result[2][node] = 2.0 * c[2] + 6.0 * s * c[3];
    result[3][node] = 6.0 * c[3];
  }
  return result;
}

using Four = double __attribute__((vector_size(32)));

}  // namespace

Stencil::Stencil(const Patch& patch, int columns, int rows) {
  const int column = std::clamp(static_cast<int>(std::floor(patch.column)) - 1, 0, columns - 4);
  const int row = std::clamp(static_cast<int>(std::floor(patch.row)) - 1, 0, rows - 4);
  // A cubic's mean over the patch is its value and half the spread times its second derivative, along either axis.
  const Cubics x = cubics(patch.column - column), y = cubics(patch.row - row);
  const double half = 0.5 * patch.spread;
  for (std::size_t j = 0; j < 4; ++j) {
    const double meanY = y[0][j] + half * y[2][j], slopeY = y[1][j] + half * y[3][j];
    for (std::size_t i = 0; i < 4; ++i) {
      const double meanX = x[0][i] + half * x[2][i], slopeX = x[1][i] + half * x[3][i];
      node[4 * j + i] = (row + static_cast<int>(j)) * columns + column + static_cast<int>(i);
      share[4 * j + i] = {meanX * meanY, slopeX * meanY, meanX * slopeY, 0.5 * (x[2][i] * meanY + meanX * y[2][j])};
    }
  }
}

TRACTION_VECTOR_CLONES
void multiplyStencils(const Stencil& a, const Stencil& b, const double* gram, double* block) {
  Four sums[4][9] = {};
  for (std::size_t i = 0; i < Stencil::kNodes; ++i) {
    Four row[9] = {};
    for (std::size_t j = 0; j < Stencil::kNodes; ++j) {
      Four share;
      __builtin_memcpy(&share, b.share[j].data(), sizeof share);
      const std::ptrdiff_t n = 3 * a.node[i], m = 3 * b.node[j];
      const std::ptrdiff_t high = n > m ? n : m, low = n > m ? m : n;
      const double* const first = gram + high * (high + 1) / 2 + low;
      const double* const second = first + high + 1;
      const double* const third = second + high + 2;
      if (n > m) {
        for (int c = 0; c < 3; ++c) {
          row[c] += first[c] * share;
          row[3 + c] += second[c] * share;
          row[6 + c] += third[c] * share;
        }
      } else if (n < m) {
        for (int c = 0; c < 3; ++c) {
          row[3 * c] += first[c] * share;
          row[3 * c + 1] += second[c] * share;
          row[3 * c + 2] += third[c] * share;
        }
      } else {  // the triangle ends at the diagonal
        row[0] += first[0] * share;
        row[1] += second[0] * share;
        row[2] += third[0] * share;
        row[3] += second[0] * share;
        row[4] += second[1] * share;
        row[5] += third[1] * share;
        for (int c = 0; c < 3; ++c) row[6 + c] += third[c] * share;
      }
    }
    for (std::size_t k = 0; k < 4; ++k) {
      for (int e = 0; e < 9; ++e) sums[k][e] += a.share[i][k] * row[e];
    }
  }
  for (int k = 0; k < 4; ++k) {
    for (int e = 0; e < 9; ++e) {
      for (int l = 0; l < 4; ++l) block[(3 * k + e / 3) * 12 + 3 * l + e % 3] = sums[k][e][l];
    }
  }
}

TRACTION_VECTOR_CLONES
void addShares(const float* row, std::span<const int> columns, const std::array<double, 4>& share, double* to) {
  Four factor, sum;
  __builtin_memcpy(&factor, share.data(), sizeof factor);
  for (const int column : columns) {
    __builtin_memcpy(&sum, to, sizeof sum);
    sum += static_cast<double>(row[column]) * factor;
    __builtin_memcpy(to, &sum, sizeof sum);
    to += 12;
  }
}

TRACTION_VECTOR_CLONES
void subtractProducts(const double* a, const double* b, std::size_t count, double* block) {
  for (std::size_t x = 0; x < 3; ++x) {
    Four sums[4][3] = {}, right[3];
    for (std::size_t j = 0; j < count; ++j) {
      __builtin_memcpy(right, b + 12 * j, sizeof right);
      for (std::size_t k = 0; k < 4; ++k) {
        for (std::size_t y = 0; y < 3; ++y) sums[k][y] += a[12 * j + 4 * x + k] * right[y];
      }
    }
    for (std::size_t k = 0; k < 4; ++k) {
      for (std::size_t y = 0; y < 3; ++y) {
        for (std::size_t l = 0; l < 4; ++l) block[12 * (3 * l + y) + 3 * k + x] -= sums[k][y][l];
      }
    }
  }
}

TRACTION_VECTOR_CLONES
void subtractMotions(const double* a, const double* motions, std::size_t count, double* block) {
  Four sums[12] = {}, motion;
  for (std::size_t j = 0; j < count; ++j) {
    __builtin_memcpy(&motion, motions + 4 * j, sizeof motion);
    for (std::size_t e = 0; e < 12; ++e) sums[e] += a[12 * j + e] * motion;
  }
  for (std::size_t e = 0; e < 12; ++e) {
    for (std::size_t m = 0; m < 4; ++m) block[12 * m + 3 * (e % 4) + e / 4] -= sums[e][m];
  }
}

}  // namespace tractiond::solve
