#include "daemon/solve/residual_test.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

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

AtomModes::AtomModes(const Factors& factors, const Atoms& atoms, int modes)
    : count(modes)
    , rows(3 * atoms.count(), modes) {
  for (int a = 0; a < atoms.count(); ++a) {
    Block products = Block::Zero();
    for (int axis = 0; axis < 3; ++axis) {
      float* const to = rows.row(3 * a + axis);
      for (Eigen::SparseMatrix<double>::InnerIterator it(atoms.shape, a); it; ++it) {
        const float* const from = factors.right.row(3 * static_cast<int>(it.row()) + axis);
        for (int k = 0; k < modes; ++k) {
          to[k] += static_cast<float>(it.value() * factors.singularValues[static_cast<std::size_t>(k)] * from[k]);
        }
      }
      for (int other = 0; other <= axis; ++other) {
        const float* const before = rows.row(3 * a + other);
        products(axis, other) = products(other, axis) = std::inner_product(to, to + modes, before, 0.0);
      }
    }
    alone.push_back(products);
  }
}

ResidualTest::ResidualTest(const Factors& factors, std::shared_ptr<const AtomModes> modes, int mostUnknowns)
    : factors_(factors)
    , atomModes_(std::move(modes))
    , modes_(atomModes_->count)
    , everyCoordinate_(every(factors.coordinateCount()))
    , everyMode_(every(modes_))
    , everyComponent_(every(atomModes_->rows.rows()))
    , seen_(LinearPosterior::kMostRank, modes_)
    , precision_(atomModes_->alone.size())
    , modesOfUnknowns_(modes_, mostUnknowns)
    , columns_(static_cast<std::size_t>(kColumns * std::max(modesOfUnknowns_.stride(), padded(modes_))))
    , sum_(static_cast<std::size_t>(padded(kMotions + modes_)))
    , products_(static_cast<std::size_t>(kColumns) * everyComponent_.size())
    , matched_(everyComponent_.size())
    , left_(static_cast<std::size_t>(padded(modes_)))
    , coefficients_(static_cast<std::size_t>(std::max(factors.coordinateCount(), LinearPosterior::kMostRank))) {}

void ResidualTest::make(const LinearPosterior& posterior, const ExtraUnknowns* extra) {
  const int rank = posterior.rank(), count = static_cast<int>(posterior.atoms().size());
  std::fill(modesOfUnknowns_.all().begin(), modesOfUnknowns_.all().end(), 0.0F);
  for (int i = 0; i < count; ++i) {
    const int atom = posterior.atoms()[static_cast<std::size_t>(i)];
    for (int axis = 0; axis < 3; ++axis) {
      const float* const from = atomModes_->rows.row(3 * atom + axis);
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
  Eigen::MatrixXd seen(rank, modes_);  // M' / n
  for (int first = 0; first < rank; first += kColumns) {
    const int end = std::min(first + kColumns, rank);
    std::fill_n(columns_.data(), columns_.size(), 0.0);
    for (int j = 0; j < posterior.firstExtra() + posterior.extraCount(); ++j) {
      for (int k = first; k < end; ++k) {
        columns_.data()[std::ptrdiff_t{kColumns} * j + k - first] =
            posterior.unknownsOfXi()(k, j) / posterior.noise_px();
      }
    }
    multiplyRowsByColumns(modesOfUnknowns_, everyMode_, columns_.data(), products_.data(), kColumns);
    for (int m = 0; m < modes_; ++m) {
      for (int k = first; k < end; ++k) {
        seen(k, m) = products_[static_cast<std::size_t>(kColumns * m + k - first)];
        seen_.row(k)[m] = static_cast<float>(seen(k, m));
      }
    }
  }
  // As if the coordinates that are missing were there: M holds them, too.
  Eigen::MatrixXd known = posterior.seenWhereMissing().transpose() * posterior.seenWhereMissing();
  for (int k = 0; k < rank; ++k) known(k, k) += 1.0 + posterior.lambda()[static_cast<std::size_t>(k)];
  const Eigen::LLT<Eigen::MatrixXd> root(known);
  root.matrixL().solveInPlace(seen);
  precision_ = atomModes_->alone;
  for (int first = 0; first < rank; first += kColumns) {
    const int end = std::min(first + kColumns, rank);
    std::fill_n(columns_.data(), columns_.size(), 0.0);
    for (int m = 0; m < modes_; ++m) {
      for (int k = first; k < end; ++k) columns_.data()[std::ptrdiff_t{kColumns} * m + k - first] = seen(k, m);
    }
    multiplyRowsByColumns(atomModes_->rows, everyComponent_, columns_.data(), products_.data(), kColumns);
    for (std::size_t a = 0; a < precision_.size(); ++a) {
      const auto explained =
          Eigen::Map<const Eigen::Matrix<double, 3, kColumns, Eigen::RowMajor>>(products_.data() + 3 * kColumns * a);
      precision_[a] -= explained * explained.transpose();
    }
  }
  for (std::size_t a = 0; a < precision_.size(); ++a) {
    precision_[a] = inverseOf(precision_[a], atomModes_->alone[a].trace());
  }
}

double ResidualTest::surest(const LinearPosterior& posterior, std::span<const float> displacement_px, double noise_px) {
  const std::span ofXi(everyCoordinate_.data(), static_cast<std::size_t>(posterior.rank()));
  std::fill_n(sum_.data(), sum_.size(), 0.0);
  addColumns(factors_.left, everyCoordinate_, displacement_px, 0, kMotions + modes_, sum_.data());
  for (int m = 0; m < modes_; ++m) left_.data()[m] = static_cast<float>(sum_.data()[kMotions + m] / noise_px);
  for (std::size_t k = 0; k < ofXi.size(); ++k) coefficients_[k] = static_cast<float>(posterior.firstXi()[k]);
  std::fill_n(sum_.data(), sum_.size(), 0.0);
  addRows(seen_, ofXi, {coefficients_.data(), ofXi.size()}, sum_.data());
  for (int m = 0; m < modes_; ++m)
    left_.data()[m] -= static_cast<float>(sum_.data()[m] * posterior.noise_px() / noise_px);
  multiplyFirst(atomModes_->rows, everyComponent_, modes_, left_.data(), matched_.data());
  double most = 0.0;
  for (std::size_t a = 0; a < precision_.size(); ++a) {
    const auto matched = Eigen::Vector3d::Map(matched_.data() + 3 * a);
    most = std::max(most, matched.dot(precision_[a] * matched));
  }
  return std::sqrt(most);
}

}  // namespace tractiond::solve
