// The covariances of a posterior: of the nodes' forces, of functionals, of the wrench and of extra unknowns.
#include "daemon/solve/posterior.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

namespace tractiond::solve {

using Eigen::Index;
using ByRows = Eigen::SparseMatrix<double, Eigen::RowMajor>;

void Posterior::nodeDeviations_N(std::span<double> deviations) {
  assert(static_cast<Index>(deviations.size()) == 3 * atoms_.ofNodes.rows());
  invertTogether();
  for (Index node = 0; node < atoms_.ofNodes.rows(); ++node) {
    for (int axis = 0; axis < 3; ++axis) {
      const std::size_t count = cover(node, axis);
      double variance = 0.0;
      for (std::size_t k = 0; k < count; ++k) {
        const double* const row = inverse_.data() + covering_[k] * std::ptrdiff_t{stride_};
        double sum = 0.5 * share_[k] * row[covering_[k]];
        for (std::size_t l = 0; l < k; ++l) sum += share_[l] * row[covering_[l]];
        variance += 2.0 * share_[k] * sum;
      }
      deviations[3 * node + axis] = noise_px_ * std::sqrt(std::max(variance, 0.0));
    }
  }
}

/// Finds the unknowns that act at a node along an axis, and their shares; for the axes in turn, as atoms act alike
/// along all. Returns their number.
std::size_t Posterior::cover(Index node, int axis) {
  if (axis == 0) {
    coveringAtoms_ = 0;
    for (ByRows::InnerIterator it(atoms_.ofNodes, node); it; ++it) {
      const int i = indexOf_[it.col()];
      if (i < 0) continue;
      covering_[coveringAtoms_] = 3 * i;
      share_[coveringAtoms_++] = it.value();
    }
  } else {
    for (std::size_t k = 0; k < coveringAtoms_; ++k) ++covering_[k];
  }
  std::size_t count = coveringAtoms_;
  for (int i = firstExtra(); i < firstMotion(); ++i) {
    const double force = std::as_const(*extra_).nodeForces_N(i - firstExtra())[3 * node + axis];
    if (force == 0.0) continue;
    covering_[count] = i;
    share_[count++] = force;
  }
  return count;
}

/// Computes the blocks of A^-1 of unknowns that act at the same node.
void Posterior::invertTogether() {
  invertDiagonal();
  const int panels = stride_ / kColumns;
  std::fill(together_.begin(), together_.end(), static_cast<unsigned char>(0));
  for (Index node = 0; node < atoms_.ofNodes.rows(); ++node) {
    for (int axis = 0; axis < 3; ++axis) {
      const std::size_t count = cover(node, axis);
      for (std::size_t k = 0; k < count; ++k) {
        unsigned char* const with = together_.data() + std::ptrdiff_t{covering_[k] / kColumns} * panels;
        for (std::size_t l = 0; l < k; ++l) with[covering_[l] / kColumns] = 1;
      }
    }
  }
  for (int panel = 2; kColumns * panel < unknowns(); ++panel) {
    for (int other = 0; other < panel - 1; ++other) {
      if (together_[panel * panels + other] != 0) invert(panel, other);
    }
  }
}

void Posterior::covariance(std::span<const double> weights, std::span<const int> points, std::span<double> covariance) {
  assert(static_cast<Index>(weights.size()) >= 3 * kColumns * atoms_.points.cols());
  double* const columns = scratch_.data();
  std::fill_n(columns, kColumns * unknowns(), 0.0);
  for (const Index point : points) {
    const double* const of = weights.data() + 3 * kColumns * point;
    const auto add = [&](double* to, double factor, int axis) {
      for (int k = 0; k < kColumns; ++k) to[k] += factor * of[axis * kColumns + k];
    };
    for (ByRows::InnerIterator it(atoms_.ofPoints, point); it; ++it) {
      const int i = indexOf_[it.col()];
      if (i < 0) continue;
      for (int axis = 0; axis < 3; ++axis) add(columns + kColumns * (3 * i + axis), it.value(), axis);
    }
    for (int i = firstExtra(); i < firstMotion(); ++i) {
      const double* const force = std::as_const(*extra_).pointForces_N(i - firstExtra()).data() + 3 * point;
      for (int axis = 0; axis < 3; ++axis) {
        if (force[axis] != 0.0) add(columns + kColumns * i, force[axis], axis);
      }
    }
  }
  multiplyInverse(kColumns, covariance.data());
}

/// n^2 C' A^-1 C of the first `count` columns C in scratch_, row after row.
void Posterior::multiplyInverse(int count, double* covariance) {
  double* const columns = scratch_.data();
  const int size = unknowns();
  const auto isSet = [](double element) { return element != 0.0; };
  const auto zeros = static_cast<int>(std::find_if(columns, columns + kColumns * size, isSet) - columns) / kColumns;
  solveLowerColumns({matrix_.data(), packed(size)}, zeros, size, columns);
  double products[kColumns * kColumns];
  multiplyColumns(columns + kColumns * zeros, columns + kColumns * zeros, size - zeros, products);
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j < count; ++j) covariance[count * i + j] = square(noise_px_) * products[kColumns * i + j];
  }
}

void Posterior::wrenchCovariance(std::array<double, 36>& covariance) {
  double* const columns = scratch_.data();
  std::fill_n(columns, kColumns * unknowns(), 0.0);
  for (std::size_t i = 0; i < chosen_->atoms.size(); ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Index component = 3 * static_cast<Index>(chosen_->atoms[i]) + static_cast<Index>(axis);
      std::copy_n(atoms_.wrench.col(component).data(), 6, columns + kColumns * (3 * i + axis));
    }
  }
  for (int i = firstExtra(); i < firstMotion(); ++i) {
    std::copy_n(std::as_const(*extra_).wrench(i - firstExtra()).data(), 6,
                columns + static_cast<std::ptrdiff_t>(kColumns) * i);
  }
  multiplyInverse(6, covariance.data());
}

void Posterior::extraCovariance(std::span<double> covariance) {
  const int count = static_cast<int>(extraCount()), from = firstExtra() / kColumns;
  for (int panel = from; kColumns * panel < unknowns(); ++panel) {
    invertColumns(panel);
    for (int other = from; other <= panel; ++other) invert(panel, other);
  }
  for (int i = 0; i < count; ++i) {
    const double* const of = inverse_.data() + (firstExtra() + i) * std::ptrdiff_t{stride_} + firstExtra();
    for (int j = 0; j < count; ++j) covariance[i * count + j] = square(noise_px_) * of[j];
  }
}

}  // namespace tractiond::solve
