#include "daemon/solve/strong_modes.h"

#include <algorithm>
#include <numeric>

namespace tractiond::solve {
namespace {

int strongest(const Factors& factors, double noise_px) {
  for (const double least : ModelConstants::kGroups) {
    const int count = modesAbove(least, factors, noise_px);
    if (count > 0) return count;
  }
  return factors.rank();
}

RowMatrix firstColumns(const RowMatrix& matrix, int columns) {
  RowMatrix first(matrix.rows(), columns);
  for (int i = 0; i < first.rows(); ++i) std::copy_n(matrix.row(i), first.stride(), first.row(i));
  return first;
}

}  // namespace

int modesAbove(double least, const Factors& factors, double noise_px) {
  const auto isStrong = [&](double s) { return s > least * noise_px / factors.force_N; };
  const auto end = std::partition_point(factors.singularValues.begin(), factors.singularValues.end(), isStrong);
  return static_cast<int>(end - factors.singularValues.begin());
}

StrongModes::StrongModes(const Factors& factors, const Atoms& atoms, double noise_px)
    : count(strongest(factors, noise_px))
    , left(firstColumns(factors.left, kMotions + count))
    , right(firstColumns(factors.right, count))
    , rows(3 * atoms.count(), count) {
  for (int a = 0; a < atoms.count(); ++a) {
    Block products = Block::Zero();
    for (int axis = 0; axis < 3; ++axis) {
      float* const to = rows.row(3 * a + axis);
      for (Eigen::SparseMatrix<double>::InnerIterator it(atoms.shape, a); it; ++it) {
        const float* const from = right.row(3 * static_cast<int>(it.row()) + axis);
        for (int k = 0; k < count; ++k) {
          to[k] += static_cast<float>(it.value() * factors.singularValues[k] * from[k]);
        }
      }
      for (int other = 0; other <= axis; ++other) {
        const float* const before = rows.row(3 * a + other);
        products(axis, other) = products(other, axis) = std::inner_product(to, to + count, before, 0.0);
      }
    }
    alone.push_back(products);
  }
}

}  // namespace tractiond::solve
