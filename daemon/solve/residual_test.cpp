#include "daemon/solve/residual_test.h"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace tractiond::solve {
namespace {

using Eigen::Index;

/// Share of an atom's variance below which the posterior explains a direction of its force wholly: what is left there
/// says nothing.
constexpr double kExplained = 1e-3;

std::vector<int> every(int count) {
  std::vector<int> all(static_cast<std::size_t>(count));
  std::iota(all.begin(), all.end(), 0);
  return all;
}

Block inverseOf(const Block& covariance, double whole) {
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
  eigen.computeDirect(covariance);
  Eigen::Vector3d inverse = Eigen::Vector3d::Zero();
  for (int k = 0; k < 3; ++k) {
    if (eigen.eigenvalues()[k] > kExplained * whole) inverse[k] = 1.0 / eigen.eigenvalues()[k];
  }
  return eigen.eigenvectors() * inverse.asDiagonal() * eigen.eigenvectors().transpose();
}

}  // namespace

ResidualTest::ResidualTest(const Factors& factors, const Atoms& atoms, int modes, int mostUnknowns)
    : factors_(factors)
    , atoms_(atoms)
    , modes_(modes)
    , everyCoordinate_(every(factors.coordinateCount()))
    , everyMode_(every(modes))
    , everyComponent_(every(3 * atoms.count()))
    , atomModes_(3 * atoms.count(), modes)
    , seen_(LinearPosterior::kMostRank, modes)
    , precision_(static_cast<std::size_t>(atoms.count()))
    , modesOfUnknowns_(modes, mostUnknowns)
    , columns_(static_cast<std::size_t>(kColumns * std::max(modesOfUnknowns_.stride(), padded(modes))))
    , sum_(static_cast<std::size_t>(padded(kMotions + modes)))
    , products_(static_cast<std::size_t>(kColumns) * everyComponent_.size())
    , matched_(everyComponent_.size())
    , left_(static_cast<std::size_t>(padded(modes)))
    , coefficients_(static_cast<std::size_t>(std::max(factors.coordinateCount(), LinearPosterior::kMostRank))) {
  for (int a = 0; a < atoms.count(); ++a) {
    Block alone = Block::Zero();
    for (int axis = 0; axis < 3; ++axis) {
      float* const to = atomModes_.row(3 * a + axis);
      for (Eigen::SparseMatrix<double>::InnerIterator it(atoms.shape, a); it; ++it) {
        const float* const from = factors.right.row(3 * static_cast<int>(it.row()) + axis);
        for (int k = 0; k < modes; ++k) {
          to[k] += static_cast<float>(it.value() * factors.singularValues[static_cast<std::size_t>(k)] * from[k]);
        }
      }
      for (int other = 0; other <= axis; ++other) {
        const float* const before = atomModes_.row(3 * a + other);
        alone(axis, other) = alone(other, axis) = std::inner_product(to, to + modes, before, 0.0);
      }
    }
    alone_.push_back(alone);
  }
}

void ResidualTest::make(const LinearPosterior& posterior, const ExtraUnknowns* extra) {
  const int rank = posterior.rank(), count = static_cast<int>(posterior.atoms().size());
  std::fill(modesOfUnknowns_.all().begin(), modesOfUnknowns_.all().end(), 0.0F);
  for (int i = 0; i < count; ++i) {
    const int atom = posterior.atoms()[static_cast<std::size_t>(i)];
    for (int axis = 0; axis < 3; ++axis) {
      const float* const from = atomModes_.row(3 * atom + axis);
      for (int k = 0; k <= axis; ++k) {
        const auto factor = static_cast<float>(posterior.root(i)(axis, k));
        for (int m = 0; m < modes_; ++m) modesOfUnknowns_.row(m)[3 * i + k] += factor * from[m];
      }
    }
  }
  for (int e = 0; e < posterior.extraCount(); ++e) {
    extra->displacement(e, coefficients_.data());
    std::fill_n(sum_.data(), sum_.size(), 0.0);
    addColumns(factors_.left, everyCoordinate_, {coefficients_.data(), everyCoordinate_.size()}, 0, kMotions + modes_,
               sum_.data());
    for (int m = 0; m < modes_; ++m) {
      modesOfUnknowns_.row(m)[posterior.firstExtra() + e] = static_cast<float>(sum_.data()[kMotions + m]);
    }
  }
  for (int a = 0; a < atoms_.count(); ++a)
    precision_[static_cast<std::size_t>(a)] = alone_[static_cast<std::size_t>(a)];
  for (int first = 0; first < rank; first += kColumns) {
    const int end = std::min(first + kColumns, rank);
    std::fill_n(columns_.data(), columns_.size(), 0.0);
    for (int k = first; k < end; ++k) {
      const float* const from = posterior.unknownsOfXi().row(k);
      for (int j = 0; j < posterior.firstExtra() + posterior.extraCount(); ++j) {
        columns_.data()[std::ptrdiff_t{kColumns} * j + k - first] = double{from[j]} / posterior.noise_px();
      }
    }
    multiplyRowsByColumns(modesOfUnknowns_, everyMode_, columns_.data(), products_.data(), kColumns);
    std::fill_n(columns_.data(), columns_.size(), 0.0);
    for (int k = first; k < end; ++k) {
      const double known = 1.0 / std::sqrt(posterior.lambda()[static_cast<std::size_t>(k)] + 1.0);
      for (int m = 0; m < modes_; ++m) {
        const std::ptrdiff_t at = std::ptrdiff_t{kColumns} * m + k - first;
        seen_.row(k)[m] = static_cast<float>(products_[static_cast<std::size_t>(at)]);
        columns_.data()[at] = known * products_[static_cast<std::size_t>(at)];
      }
    }
    multiplyRowsByColumns(atomModes_, everyComponent_, columns_.data(), products_.data(), kColumns);
    for (std::size_t a = 0; a < precision_.size(); ++a) {
      const auto known =
          Eigen::Map<const Eigen::Matrix<double, 3, kColumns, Eigen::RowMajor>>(products_.data() + 3 * kColumns * a);
      precision_[a] -= known * known.transpose();
    }
  }
  for (std::size_t a = 0; a < precision_.size(); ++a) precision_[a] = inverseOf(precision_[a], alone_[a].trace());
}

double ResidualTest::surest(const LinearPosterior& posterior, std::span<const float> displacement_px, double noise_px) {
  const std::span ofXi(everyCoordinate_.data(), static_cast<std::size_t>(posterior.rank()));
  std::fill_n(sum_.data(), sum_.size(), 0.0);
  addColumns(factors_.left, everyCoordinate_, displacement_px, 0, kMotions + modes_, sum_.data());
  for (int m = 0; m < modes_; ++m) left_.data()[m] = static_cast<float>(sum_.data()[kMotions + m] / noise_px);
  for (std::size_t k = 0; k < ofXi.size(); ++k) coefficients_[k] = static_cast<float>(posterior.xi()[k]);
  std::fill_n(sum_.data(), sum_.size(), 0.0);
  addRows(seen_, ofXi, {coefficients_.data(), ofXi.size()}, sum_.data());
  for (int m = 0; m < modes_; ++m)
    left_.data()[m] -= static_cast<float>(sum_.data()[m] * posterior.noise_px() / noise_px);
  multiplyFirst(atomModes_, everyComponent_, modes_, left_.data(), matched_.data());
  double most = 0.0;
  for (std::size_t a = 0; a < precision_.size(); ++a) {
    const auto matched = Eigen::Vector3d::Map(matched_.data() + 3 * a);
    most = std::max(most, matched.dot(precision_[a] * matched));
  }
  return std::sqrt(most);
}

}  // namespace tractiond::solve
