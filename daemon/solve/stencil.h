// Products of the stencils of round patches with the nodes' products, with markers and with motions.
#pragma once

#include "daemon/solve/patch.h"

#include <array>
#include <cstddef>
#include <span>

namespace tractiond::solve {

/// Computes block[12 (3 k + x) + 3 l + y] = sum over the nodes i of a and j of b of a.share[i][k] b.share[j][l] times
/// the element of H'H at (3 i + x, 3 j + y). \param gram lower triangle of H'H, packed row after row
void multiplyStencils(const Stencil& a, const Stencil& b, const double* gram, double* block);

/// Computes to[12 j + 0 .. 3] += row[columns[j]] share. \param to place of a component
void addShares(const float* row, std::span<const int> columns, const std::array<double, 4>& share, double* to);

/// Computes block[12 (3 l + y) + 3 k + x] -= sum over j < count of a[12 j + 4 x + k] b[12 j + 4 y + l].
void subtractProducts(const double* a, const double* b, std::size_t count, double* block);

/// Computes block[12 m + 3 k + x] -= sum over j < count of a[12 j + 4 x + k] motions[4 j + m].
void subtractMotions(const double* a, const double* motions, std::size_t count, double* block);

}  // namespace tractiond::solve
