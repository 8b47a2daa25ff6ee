// The covariances of a linear posterior: of the wrench, of the nodes' forces, of functionals and of extra unknowns.
#include "daemon/solve/linear_posterior.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace tractiond::solve {
namespace {

/// Elements of xi that leastVariances() counts. With 32, those that are seen least, one fall between two hills in ten
/// is left to covariance() that is none; with 16 one in four.
constexpr int kLeastSeen = 32;

}  // namespace

/// Divides kColumns functionals of xi by the root of its precision.
void LinearPosterior::whiten(double* columns) const {
  if (isDense_) {
    solveLowerColumns(factor(), 0, rank_, columns);
    return;
  }
  for (int k = 0; k < rank_; ++k) {
    const double factor = 1.0 / std::sqrt(precision_[k]);
    for (int c = 0; c < kColumns; ++c) *columns++ *= factor;
  }
}

void LinearPosterior::wrenchCovariance(std::array<double, 36>& covariance) {
  double* const columns = seenColumns_.data();
  std::fill_n(columns, kColumns * rank_, 0.0);
  for (int k = 0; k < rank_; ++k) std::copy_n(wrench_.col(k).data(), 6, columns + std::ptrdiff_t{kColumns} * k);
  whiten(columns);
  std::array<double, kColumns * kColumns> products;
  multiplyColumns(columns, columns, rank_, products.data());
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) {
      covariance[6 * i + j] = products[kColumns * i + j] + square(scale_) * wrenchUnseen_(i, j);
    }
  }
}

void LinearPosterior::nodeDeviations_N(std::span<double> deviations) {
  if (isDense_) {
    denseNodeVariances(deviations);
  } else {
    std::fill_n(coefficients_.begin(), padded(rank_), 0.0F);
    for (int k = 0; k < rank_; ++k) coefficients_[k] = static_cast<float>(1.0 / precision_[k]);
    sumSquares(nodes_, rank_, coefficients_.data(), deviations.data());
  }
  for (std::size_t i = 0; i < deviations.size(); ++i) {
    deviations[i] = std::sqrt(deviations[i] + square(scale_) * nodesUnseen_[i]);
  }
}

/// Computes the variances of the nodes' forces by xi.
void LinearPosterior::denseNodeVariances(std::span<double> variances) {
  double* const columns = seenColumns_.data();
  const auto count = static_cast<int>(variances.size());
  for (int first = 0; first < count; first += kColumns) {
    const int end = std::min(first + kColumns, count);
    std::fill_n(columns, kColumns * rank_, 0.0);
    for (int i = first; i < end; ++i) {
      const float* const of = nodes_.data() + std::ptrdiff_t{padded(rank_)} * i;
      for (int k = 0; k < rank_; ++k) columns[std::ptrdiff_t{kColumns} * k + i - first] = double{of[k]};
    }
    whiten(columns);
    for (int i = first; i < end; ++i) {
      double& sum = variances[i] = 0.0;
      for (int k = 0; k < rank_; ++k) sum += square(columns[std::ptrdiff_t{kColumns} * k + i - first]);
    }
  }
}

void LinearPosterior::covariance(std::span<const double> weights, std::span<const int> points,
                                 std::span<double> covariance) {
  setFunctionals(weights, points);
  functionalCovariance(kColumns, covariance.data());
}

/// What the picture sees least of xi has most of the variance. Coordinates that were added make it larger.
void LinearPosterior::leastVariances(std::span<const double> weights, std::span<const int> points,
                                     std::span<double> variances) {
  setFunctionals(weights, points);
  const int rank = std::min(rank_, kLeastSeen);
  showFunctionals(rank);
  std::fill(variances.begin(), variances.end(), 0.0);
  for (int k = 0; k < rank; ++k) {
    const double factor = 1.0 / precision_[k];
    for (std::size_t c = 0; c < variances.size(); ++c)
      variances[c] +=
          factor * square(seenColumns_.data()[std::ptrdiff_t{kColumns} * k + static_cast<std::ptrdiff_t>(c)]);
  }
}

/// Takes functionals of the points' forces and the couples.
void LinearPosterior::setFunctionals(std::span<const double> weights, std::span<const int> points) {
  beginFunctionals();
  for (const int point : points) {
    const auto p = static_cast<std::size_t>(point);
    const auto [sharing, shares] = this->sharing(p);
    const auto extra = std::span(extraUnknowns_).subspan(extraFirst_[p], extraFirst_[p + 1] - extraFirst_[p]);
    if (sharing.empty() && extra.empty()) continue;
    const double* const of = weights.data() + 3 * kColumns * p;
    for (const int atom : sharing) use(atom);
    addShares(sharing, blockOf_, shares.data(), of, blocks());
    addForces(extra, extraShares_.data() + 3 * extraFirst_[p], of, functionals_.data());
  }
  multiplyBlocks(used_, roots_.data()->data(), blocks());  // so far of the forces of the atoms themselves
}

void LinearPosterior::extraCovariance(std::span<const int> unknowns, std::span<double> covariance) {
  assert(unknowns.size() <= kColumns);
  beginFunctionals();
  for (std::size_t i = 0; i < unknowns.size(); ++i) functionals_(unknowns[i], static_cast<Eigen::Index>(i)) = 1.0;
  functionalCovariance(static_cast<int>(unknowns.size()), covariance.data());
}

/// Starts with functionals of nothing.
void LinearPosterior::beginFunctionals() {
  for (const int atom : used_) blockOf_[atom] = -1;
  used_.clear();
  functionals_.topRows(extraCount_).setZero();
}

/// Makes room for an atom in the functionals.
void LinearPosterior::use(int atom) {
  int& block = blockOf_[atom];
  if (block >= 0) return;
  block = static_cast<int>(used_.size());
  used_.push_back(atom);
  functionals_.middleRows<3>(extraCount_ + 3 * block).setZero();
}

/// Computes what the first `rank` elements of xi show of the functionals.
void LinearPosterior::showFunctionals(int rank) {
  std::fill_n(seenColumns_.data(), kColumns * rank, 0.0);
  const auto rows = extraCount_ + 3 * static_cast<int>(used_.size());
  for (int row = 0; row < rows; ++row) {
    const int ofAtoms = row - extraCount_;
    const int unknown = ofAtoms < 0 ? firstExtra() + row : 3 * used_[ofAtoms / 3] + ofAtoms % 3;
    addProducts(q_.col(unknown).data(), functionals_.row(row).data(), rank, seenColumns_.data());
  }
}

/// Computes the covariance of the functionals of theta.
void LinearPosterior::functionalCovariance(int count, double* covariance) {
  showFunctionals(rank_);
  auto seen = decltype(functionals_)::Map(seenColumns_.data(), rank_, kColumns);
  const auto rows = extraCount_ + 3 * static_cast<int>(used_.size());
  using Products = std::array<double, kColumns * kColumns>;
  Products prior, across, within;
  multiplyColumns(functionals_.data(), functionals_.data(), rows, prior.data());
  multiplyColumns(seen.data(), seen.data(), rank_, across.data());
  whiten(seen.data());
  multiplyColumns(seen.data(), seen.data(), rank_, within.data());
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j < count; ++j) {
      const auto at = static_cast<std::size_t>(kColumns * i + j);
      double unseen = prior[at] - across[at];
      if (i == j) unseen = std::max(0.0, unseen);  // rounding may make it < 0
      covariance[count * i + j] = within[at] + square(scale_) * unseen;
    }
  }
}

}  // namespace tractiond::solve
