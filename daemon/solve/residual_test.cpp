#include "daemon/solve/residual_test.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <utility>

namespace tractiond::solve {
namespace {

using Eigen::Index;
using Products = Eigen::Matrix<double, Eigen::Dynamic, kColumns, Eigen::RowMajor>;  // of rows with columns

/// Share of an atom's variance below which the posterior explains a direction of its force wholly: what is left there
/// says nothing.
constexpr double kExplained = 1e-3;

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

ResidualTest::ResidualTest(std::shared_ptr<const StrongModes> modes, int mostUnknowns, int mostCurves)
    : strong_(std::move(modes))
    , modes_(strong_->count)
    , everyCoordinate_(every(strong_->left.rows()))
    , everyMode_(every(modes_))
    , everyComponent_(every(strong_->rows.rows()))
    , precision_(strong_->alone.size())
    , modesOfUnknowns_(modes_, mostUnknowns + mostCurves)
    , columns_(kColumns * std::max(modesOfUnknowns_.stride(), padded(modes_)))
    , sum_(padded(kMotions + modes_))
    , left_(padded(modes_))
    , found_(padded(LinearPosterior::kMostRank + mostCurves))
    , products_(kColumns * everyComponent_.size())
    , matched_(everyComponent_.size())
    , added_(everyComponent_.size())
    , coefficients_(everyCoordinate_.size()) {}

void ResidualTest::make(const LinearPosterior& posterior, const ExtraUnknowns* extra, const RowMatrix& curves) {
  const int rank = posterior.rank();
  layUnknowns(posterior, extra, curves);
  Eigen::MatrixXd seen = seenBy(posterior, curves.rows());
  // As if the coordinates that are missing were there: M holds them, too.
  root_ = posterior.seenWhereMissing().transpose() * posterior.seenWhereMissing();
  for (int k = 0; k < rank; ++k) root_(k, k) += 1.0 + posterior.lambda()[k];
  root_ = root_.llt().matrixL();
  root_.triangularView<Eigen::Lower>().solveInPlace(seen.topRows(rank));
  explain(seen, rank);
}

/// Computes what each mode shows of the unknowns and of the curves.
void ResidualTest::layUnknowns(const LinearPosterior& posterior, const ExtraUnknowns* extra, const RowMatrix& curves) {
  const int count = static_cast<int>(posterior.atoms().size());
  const int firstCurve = posterior.firstExtra() + posterior.extraCount();
  std::fill(modesOfUnknowns_.all().begin(), modesOfUnknowns_.all().end(), 0.0F);
  for (int i = 0; i < count; ++i) {
    const int atom = posterior.atoms()[i];
    for (int axis = 0; axis < 3; ++axis) {
      const float* const from = strong_->rows.row(3 * atom + axis);
      for (int k = 0; k <= axis; ++k) {
        const auto factor = static_cast<float>(posterior.root(i)(axis, k));
        for (int m = 0; m < modes_; ++m) modesOfUnknowns_.row(m)[3 * i + k] += factor * from[m];
      }
    }
  }
  for (int column = posterior.firstExtra(); column < firstCurve + curves.rows(); ++column) {
    if (column < firstCurve) extra->displacement(column - posterior.firstExtra(), coefficients_.data());
    const float* const displacement_px = column < firstCurve ? coefficients_.data() : curves.row(column - firstCurve);
    std::fill_n(sum_.data(), sum_.size(), 0.0);
    addColumns(strong_->left, everyCoordinate_, {displacement_px, everyCoordinate_.size()}, 0, kMotions + modes_,
               sum_.data());
    for (int m = 0; m < modes_; ++m) modesOfUnknowns_.row(m)[column] = static_cast<float>(sum_.data()[kMotions + m]);
  }
}

/// Returns M' / n, then the curves: (rank + curves) x modes.
Eigen::MatrixXd ResidualTest::seenBy(const LinearPosterior& posterior, int curves) {
  const int rank = posterior.rank(), all = rank + curves;
  const int firstCurve = posterior.firstExtra() + posterior.extraCount();
  Eigen::MatrixXd seen(all, modes_);
  for (int first = 0; first < all; first += kColumns) {
    const int end = std::min(first + kColumns, all);
    std::fill_n(columns_.data(), columns_.size(), 0.0);
    const auto factor = [&](int unknown, int k) -> double& {
      return columns_.data()[std::ptrdiff_t{kColumns} * unknown + k - first];
    };
    for (int k = first; k < end; ++k) {
      for (int unknown = 0; k < rank && unknown < firstCurve; ++unknown) {
        factor(unknown, k) = posterior.unknownsOfXi()(k, unknown) / posterior.noise_px();
      }
      if (k >= rank) factor(firstCurve + k - rank, k) = 1.0;
    }
    multiplyRowsByColumns(modesOfUnknowns_, everyMode_, columns_.data(), products_.data(), kColumns);
    for (int m = 0; m < modes_; ++m) {
      for (int k = first; k < end; ++k) seen(k, m) = products_[kColumns * m + k - first];
    }
  }
  return seen;
}

/// Computes what is explained of the atoms, and how surely each is then known.
/// \param seen of seenBy(), whitened
void ResidualTest::explain(const Eigen::MatrixXd& seen, int rank) {
  const int all = static_cast<int>(seen.rows());
  precision_ = strong_->alone;
  explained_ = RowMatrix(3 * static_cast<int>(precision_.size()), all);
  for (int first = 0; first < all; first += kColumns) {
    const int end = std::min(first + kColumns, all), ofXi = std::clamp(rank - first, 0, kColumns);
    std::fill_n(columns_.data(), columns_.size(), 0.0);
    for (int m = 0; m < modes_; ++m) {
      for (int k = first; k < end; ++k) columns_.data()[std::ptrdiff_t{kColumns} * m + k - first] = seen(k, m);
    }
    multiplyRowsByColumns(strong_->rows, everyComponent_, columns_.data(), products_.data(), kColumns);
    explained_.view().middleCols(first, end - first) =
        Products::Map(products_.data(), explained_.rows(), kColumns).leftCols(end - first).cast<float>();
    for (std::size_t a = 0; a < precision_.size(); ++a) {
      const auto explained =
          Eigen::Map<const Eigen::Matrix<double, 3, kColumns, Eigen::RowMajor>>(products_.data() + 3 * kColumns * a)
              .leftCols(ofXi);
      precision_[a] -= explained * explained.transpose();
    }
  }
  for (std::size_t a = 0; a < precision_.size(); ++a) {
    precision_[a] = inverseOf(precision_[a], strong_->alone[a].trace());
  }
}

void ResidualTest::begin(std::span<const double> matched) {
  std::copy(matched.begin(), matched.end(), matched_.begin());
}

void ResidualTest::begin(std::span<const float> displacement_px) {
  std::fill(matched_.begin(), matched_.end(), 0.0);
  add(everyCoordinate_, displacement_px);
}

void ResidualTest::add(std::span<const int> coordinates, std::span<const float> displacement_px) {
  if (coordinates.empty()) return;
  std::fill_n(sum_.data(), sum_.size(), 0.0);
  addColumns(strong_->left, coordinates, displacement_px, 0, kMotions + modes_, sum_.data());
  std::copy_n(sum_.data() + kMotions, modes_, left_.data());
  multiplyFirst(strong_->rows, everyComponent_, modes_, left_.data(), added_.data());
  for (std::size_t i = 0; i < added_.size(); ++i) matched_[i] += added_[i];
}

double ResidualTest::significance(const LinearPosterior& posterior, std::span<const double> times, double noise_px) {
  const int rank = posterior.rank();
  const auto xi = Eigen::VectorXd::Map(posterior.firstXi().data(), rank);
  auto found = Eigen::VectorXf::Map(found_.data(), explained_.stride());
  found.setZero();
  for (int k = 0; k < rank; ++k) {
    found[k] = static_cast<float>(posterior.noise_px() * root_.col(k).tail(rank - k).dot(xi.tail(rank - k)));
  }
  for (std::size_t c = 0; c < times.size(); ++c) {
    found[rank + static_cast<Index>(c)] = static_cast<float>(times[c]);
  }
  multiplyFirst(explained_, everyComponent_, explained_.columns(), found_.data(), added_.data());
  double most = 0.0;
  for (std::size_t a = 0; a < precision_.size(); ++a) {
    const Eigen::Vector3d left =
        Eigen::Vector3d::Map(matched_.data() + 3 * a) - Eigen::Vector3d::Map(added_.data() + 3 * a);
    most = std::max(most, left.dot(precision_[a] * left));
  }
  return std::sqrt(most) / noise_px;
}

}  // namespace tractiond::solve
