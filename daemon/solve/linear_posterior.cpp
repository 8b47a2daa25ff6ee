#include "daemon/solve/linear_posterior.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>

namespace tractiond::solve {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// Directions of theta that the picture sees by less than this share of its noise are left to the prior, which is on
/// the safe side; of the rest of all unknowns together some are seen by up to a third.
constexpr double kFaintest = 0.05;
/// s is one of 2^(k / kSteps), k = 0 .. kMostSteps, unless the force has grown by more; its prior deviation is an
/// octave.
constexpr int kSteps = 4, kMostSteps = 5;
/// The most coordinates that may be missing in addition, a multiple of what multiplyPairs() takes at a time.
constexpr int kMostAdded = 512;

/// Pivoted Cholesky decomposition A = T T' of a positive semidefinite matrix, until no diagonal element of the rest
/// is above `least`. Fills columns of `root` and returns their number.
int decompose(const MatrixXd& a, double least, MatrixXd& root, std::vector<int>& pivots) {
  Eigen::VectorXd left = a.diagonal();
  pivots.clear();
  for (int rank = 0; rank < root.cols(); ++rank) {
    Index at = 0;
    const double most = left.head(a.rows()).maxCoeff(&at);
    if (!(most > least)) return rank;
    auto column = root.col(rank).head(a.rows());
    column = a.col(at);
    column.noalias() -= root.topLeftCorner(a.rows(), rank) * root.row(at).head(rank).transpose();
    column /= std::sqrt(most);
    left -= column.cwiseAbs2();
    left[at] = 0.0;
    pivots.push_back(static_cast<int>(at));
  }
  return static_cast<int>(root.cols());
}

}  // namespace

LinearPosterior::LinearPosterior(const Factors& factors, const Atoms& atoms, int most, int mostExtra)
    : factors_(factors)
    , model_(atoms)
    , indexOf_(atoms.count(), -1)
    , lambda_(kMostRank)
    , rows_(kMostRank, factors.coordinateCount(), Pages::kSmall)
    , nodesUnseen_(3 * atoms.nodeCount())
    , read_(kMostRank)
    , y_(kMostRank)
    , xi_(kMostRank)
    , firstXi_(kMostRank)
    , theta_(mostUnknowns(most, mostExtra))
    , precision_(kMostRank)
    , dense_(kMostRank * (kMostAdded + kMostRank + (kMostRank + 1) / 2 + 1), Pages::kSmall)
    , taken_(dense_.data() + std::ptrdiff_t{kMostRank} * kMostAdded)
    , root_(taken_ + std::ptrdiff_t{kMostRank} * kMostRank)
    , blockOf_(most, -1)
    , functionals_(mostUnknowns(most, mostExtra), kColumns)
    , seenColumns_(kColumns * kMostRank)
    , scratch_(kColumns * kMostRank)
    , everyRow_(every(kMostRank))
    , coefficients_(kMostRank) {
  atoms_.reserve(most);
  used_.reserve(most);
  roots_.reserve(most);
  for (int k = 0; k < kMostRank; ++k) addedRows_.push_back(dense_.data() + std::ptrdiff_t{kMostAdded} * k);
}

bool LinearPosterior::make(const Posterior& posterior, AtomProducts& products, std::span<const int> missing,
                           double force_N, const RowMatrix& curves, LinearScratch& scratch) {
  noise_px_ = posterior.noise_px();
  force_N_ = force_N;
  if (!takePrior(posterior)) return false;
  products.add(posterior.chosen().atoms);
  assemble(posterior, products, scratch.gram);
  scratch.root.resize(unknowns(), kMostRank);
  const int pivots = decompose(scratch.gram, kFaintest, scratch.root, scratch.pivots);
  const auto root = scratch.root.leftCols(pivots);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(root.transpose() * root);
  if (eigen.info() != Eigen::Success) return false;
  int first = 0;
  while (first < pivots && eigen.eigenvalues()[first] < kFaintest) ++first;
  rank_ = pivots - first;
  const Eigen::VectorXd lambda = eigen.eigenvalues().tail(rank_);
  std::copy_n(lambda.data(), rank_, lambda_.begin());
  const auto vectors = eigen.eigenvectors().rightCols(rank_);
  q_ = (root * (vectors * lambda.cwiseSqrt().cwiseInverse().asDiagonal())).transpose();
  // B R Q = (columns at the pivots) C, the rest being combinations of these.
  MatrixXd triangle(pivots, pivots);
  for (int i = 0; i < pivots; ++i) triangle.row(i) = root.row(scratch.pivots[i]);
  const MatrixXd combine =
      triangle.triangularView<Eigen::Lower>().transpose().solve(vectors * lambda.cwiseSqrt().asDiagonal());
  layRows(posterior, combine, scratch);
  layMissing(missing);
  layNodes(posterior);
  layWrench(posterior);
  layShares(posterior);
  layCurves(missing, curves);
  return true;
}

/// Takes atoms and roots of their priors.
bool LinearPosterior::takePrior(const Posterior& posterior) {
  for (const int atom : atoms_) indexOf_[atom] = -1;
  const Chosen& chosen = posterior.chosen();
  atoms_ = chosen.atoms;
  roots_.clear();
  for (std::size_t i = 0; i < atoms_.size(); ++i) {
    indexOf_[atoms_[i]] = static_cast<int>(i);
    const Eigen::LLT<Block> root(chosen.covariance_N2[i]);
    if (root.info() != Eigen::Success) return false;
    roots_.emplace_back(root.matrixL());
  }
  extraCount_ = posterior.extraUnknowns() == nullptr ? 0 : posterior.extraUnknowns()->count();
  return true;
}

/// Fills `gram` with R B'B R / n^2.
void LinearPosterior::assemble(const Posterior& posterior, const AtomProducts& products, MatrixXd& gram) const {
  const auto count = static_cast<int>(atoms_.size());
  const int extraFirst = firstExtra(), motionFirst = firstMotion();
  ExtraUnknowns* const extra = posterior.extraUnknowns();
  gram.resize(unknowns(), unknowns());
  for (int i = 0; i < count; ++i) {
    const int index = products.indexOf(atoms_[i]);
    for (int j = 0; j <= i; ++j) {
      const int other = products.indexOf(atoms_[j]);
      Block block;
      for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c) block(r, c) = products.row(index + r)[other + c];
      }
      gram.block<3, 3>(3 * Index{i}, 3 * Index{j}) = root(i).transpose() * block * root(j);
    }
    for (int m = 0; m < kMotions; ++m) {
      gram.block<1, 3>(motionFirst + m, 3 * Index{i}) = Eigen::RowVector3d::Map(products.row(m) + index) * root(i);
    }
    if (extra == nullptr) continue;
    const auto with =
        Eigen::Map<const Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor>, 0, Eigen::OuterStride<>>(
            extra->productsWith(atoms_[i]), 3, extraCount_, Eigen::OuterStride<>(extra->stride()));
    gram.block(extraFirst, 3 * Index{i}, extraCount_, 3) = with.transpose() * root(i);
  }
  for (int e = 0; e < extraCount_; ++e) {
    for (int other = 0; other <= e; ++other) gram(extraFirst + e, extraFirst + other) = extra->product(e, other);
    for (int m = 0; m < kMotions; ++m) gram(motionFirst + m, extraFirst + e) = extra->withMotion(e, m);
  }
  for (int m = 0; m < kMotions; ++m) {
    for (int other = 0; other <= m; ++other) gram(motionFirst + m, motionFirst + other) = products.row(m)[other];
  }
  gram /= square(noise_px_);
  gram.triangularView<Eigen::StrictlyUpper>() = gram.transpose();
}

/// Computes rows_ from the columns of B R at the pivots.
void LinearPosterior::layRows(const Posterior& posterior, const MatrixXd& combine, LinearScratch& scratch) {
  const auto pivots = static_cast<int>(scratch.pivots.size());
  const int coordinates = factors_.coordinateCount();
  if (scratch.seen.rows() == 0) scratch.seen = RowMatrix(kMostRank, coordinates, Pages::kSmall);
  std::vector<double> sum(rows_.stride());
  for (int p = 0; p < pivots; ++p) {
    const int unknown = scratch.pivots[p];
    float* const to = scratch.seen.row(p);
    if (unknown >= firstMotion()) {
      std::copy_n(factors_.motion.row(unknown - firstMotion()), coordinates, to);
    } else if (unknown >= firstExtra()) {
      posterior.extraUnknowns()->displacement(unknown - firstExtra(), to);
    } else {
      const int atom = atoms_[unknown / 3];
      const std::array<int, 3> rows = {3 * atom, 3 * atom + 1, 3 * atom + 2};
      const Eigen::Vector3f factors = root(unknown / 3).col(unknown % 3).cast<float>();
      std::fill(sum.begin(), sum.end(), 0.0);
      addRows(factors_.influence, rows, {factors.data(), 3}, sum.data());
      std::copy_n(sum.begin(), coordinates, to);
    }
  }
  const std::span ofPivots(everyRow_.data(), static_cast<std::size_t>(pivots));
  for (int k = 0; k < rank_; ++k) {
    for (int p = 0; p < pivots; ++p) {
      coefficients_[p] = static_cast<float>(combine(p, k) / square(noise_px_));
    }
    std::fill(sum.begin(), sum.end(), 0.0);
    addRows(scratch.seen, ofPivots, {coefficients_.data(), ofPivots.size()}, sum.data());
    std::copy_n(sum.begin(), coordinates, rows_.row(k));
  }
}

/// Computes seenWhereMissing_. There the columns at the pivots do not stand for the others.
void LinearPosterior::layMissing(std::span<const int> missing) {
  MatrixXd columns = MatrixXd::Zero(std::ssize(missing), unknowns());
  for (Index row = 0; row < columns.rows(); ++row) {
    const int coordinate = missing[row];
    for (int i = 0; i < std::ssize(atoms_); ++i) {
      const Eigen::RowVector3d unit =
          factors_.influence.view().block<3, 1>(3 * atoms_[i], coordinate).transpose().cast<double>();
      columns.block<1, 3>(row, 3 * Index{i}) = unit * root(i);
    }
    for (int m = 0; m < kMotions; ++m) columns(row, firstMotion() + m) = factors_.motion.row(m)[coordinate];
  }
  seenWhereMissing_ = columns * q_.transpose() / noise_px_;
}

/// Computes what xi does to the forces of the nodes, and the variance of what it does not hold.
void LinearPosterior::layNodes(const Posterior& posterior) {
  const Index nodes = model_.ofNodes.rows();
  nodes_.assign(3 * nodes * padded(rank_), 0.0F);
  MatrixXd forces(rank_, 3), all(rank_, 3 * std::ssize(atoms_));  // of the atoms
  for (int i = 0; i < std::ssize(atoms_); ++i) {
    all.middleCols<3>(3 * Index{i}) = q_.middleCols<3>(3 * Index{i}) * root(i).transpose();
  }
  for (Index node = 0; node < nodes; ++node) {
    Eigen::Vector3d prior = Eigen::Vector3d::Zero();
    forces.setZero();
    for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator it(model_.ofNodes, node); it; ++it) {
      const int i = indexOf_[it.col()];
      if (i < 0) continue;
      forces += it.value() * all.middleCols<3>(3 * Index{i});
      prior += square(it.value()) * root(i).rowwise().squaredNorm();
    }
    for (int e = 0; e < extraCount_; ++e) {
      const Eigen::Vector3d unit = Eigen::Vector3d::Map(posterior.extraUnknowns()->nodeForces_N(e).data() + 3 * node);
      if (unit.isZero(0.0)) continue;
      prior += unit.cwiseAbs2();
      forces += q_.col(firstExtra() + e) * unit.transpose();
    }
    for (Index axis = 0; axis < 3; ++axis) {
      const Index row = 3 * node + axis;
      Eigen::VectorXf::Map(nodes_.data() + padded(rank_) * row, rank_) = forces.col(axis).cast<float>();
      nodesUnseen_[row] = std::max(0.0, prior[axis] - forces.col(axis).squaredNorm());
    }
  }
}

void LinearPosterior::layWrench(const Posterior& posterior) {
  Eigen::Matrix<double, 6, Eigen::Dynamic> ofUnknowns(6, unknowns());
  ofUnknowns.setZero();
  for (int i = 0; i < std::ssize(atoms_); ++i) {
    ofUnknowns.middleCols<3>(3 * Index{i}) = model_.wrench.middleCols<3>(3 * Index{atoms_[i]}) * root(i);
  }
  for (int e = 0; e < extraCount_; ++e) {
    ofUnknowns.col(firstExtra() + e) = std::as_const(*posterior.extraUnknowns()).wrench(e);
  }
  wrench_ = ofUnknowns * q_.transpose();
  wrenchUnseen_ = ofUnknowns * ofUnknowns.transpose() - wrench_ * wrench_.transpose();
}

/// Lists which unknowns act on each point.
void LinearPosterior::layShares(const Posterior& posterior) {
  const Index points = model_.ofPoints.rows();
  for (auto* each : {&sharing_, &extraUnknowns_}) each->clear();
  for (auto* each : {&shares_, &extraShares_}) each->clear();
  for (auto* each : {&sharingFirst_, &extraFirst_}) each->assign(1, 0);
  for (Index point = 0; point < points; ++point) {
    for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator it(model_.ofPoints, point); it; ++it) {
      const int i = indexOf_[it.col()];
      if (i < 0) continue;
      sharing_.push_back(i);
      shares_.push_back(it.value());
    }
    for (int e = 0; e < extraCount_; ++e) {
      const auto unit = std::as_const(*posterior.extraUnknowns()).pointForces_N(e).subspan(3 * point, 3);
      if (unit[0] == 0.0 && unit[1] == 0.0 && unit[2] == 0.0) continue;
      extraUnknowns_.push_back(e);
      extraShares_.insert(extraShares_.end(), unit.begin(), unit.end());
    }
    sharingFirst_.push_back(sharing_.size());
    extraFirst_.push_back(extraUnknowns_.size());
  }
}

/// Computes curves_ as if the curves were 0 where the picture missed coordinates.
void LinearPosterior::layCurves(std::span<const int> missing, const RowMatrix& curves) {
  curves_.resize(rank_, curves.rows());
  curvesNow_.resize(rank_, curves.rows());
  std::vector<double> curve(rows_.stride());
  for (int c = 0; c < curves.rows(); ++c) {
    std::copy_n(curves.row(c), curve.size(), curve.begin());
    for (const int coordinate : missing) curve[coordinate] = 0.0;
    multiplyRows(rows_, {everyRow_.data(), static_cast<std::size_t>(rank_)}, curve.data(), curves_.col(c).data());
  }
}

bool LinearPosterior::read(const double* displacement_px, double noise_px, std::span<const int> added,
                           const RowMatrix& curves) {
  if (std::ssize(added) > kMostAdded) return false;
  squaredNoise_px2_ = square(noise_px);
  ratio_ = square(noise_px_) / squaredNoise_px2_;
  multiplyRows(rows_, {everyRow_.data(), static_cast<std::size_t>(rank_)}, displacement_px, read_.data());
  for (double& each : read_) each *= ratio_;
  takeOut(added);
  curvesNow_ = curves_;
  for (int c = 0; c < curves_.cols(); ++c) {
    for (const int coordinate : added) {
      const double there = curves.row(c)[coordinate];
      for (int k = 0; k < rank_; ++k) curvesNow_(k, c) -= there * double{rows_.row(k)[coordinate]};
    }
  }
  return true;
}

bool LinearPosterior::solve(std::span<const double> times) {
  std::copy_n(read_.begin(), rank_, y_.begin());
  for (std::size_t c = 0; c < times.size(); ++c) {
    Eigen::VectorXd::Map(y_.data(), rank_) -= ratio_ * times[c] * curvesNow_.col(static_cast<Index>(c));
  }
  if (!solveWith(1.0)) return false;
  firstXi_ = xi_;
  scale_ = std::max(likeliestScale(), forceOfXi_N() / force_N_);
  if (scale_ > 1.0 && !solveWith(scale_)) return false;
  findUnknowns(firstExtra(), extraCount_);
  return true;
}

/// Computes some elements of theta.
void LinearPosterior::findUnknowns(int first, int count) {
  Eigen::VectorXd::Map(theta_.data() + first, count).noalias() =
      q_.middleCols(first, count).transpose() * Eigen::VectorXd::Map(xi_.data(), rank_);
}

void LinearPosterior::weigh(double squares_px2) {
  findUnknowns(0, unknowns());
  std::copy_n(theta_.begin() + firstMotion(), kMotions, motion_.begin());
  misfit_ = squares_px2 / squaredNoise_px2_ - dot(xi_, y_);
  logEvidence_ = -0.5 * (misfit_ + logDeterminant_ + square(std::log2(scale_)));
  squaredResidual_ = squaredNoise_px2_ * (misfit_ - dot(xi_, xi_) / square(scale_));
}

double LinearPosterior::dot(const std::vector<double>& a, const std::vector<double>& b) const {
  return dotProduct(a.data(), b.data(), rank_);
}

/// Computes what the added coordinates have of Lambda.
void LinearPosterior::takeOut(std::span<const int> added) {
  isDense_ = !added.empty();
  if (!isDense_) return;
  const auto size = (std::ssize(added) + 3) / 4 * 4;
  for (int k = 0; k < rank_; ++k) {
    double* const to = dense_.data() + std::ptrdiff_t{kMostAdded} * k;
    std::fill_n(to, size, 0.0);
    for (std::size_t i = 0; i < added.size(); ++i) to[i] = noise_px_ * double{rows_.row(k)[added[i]]};
  }
  const std::span<const double* const> rows(addedRows_.data(), static_cast<std::size_t>(rank_));
  multiplyPairs(rows, 0, static_cast<int>(size), taken_, kMostRank);
}

/// Solves for xi with a scale of the prior. Also computes the log determinant of s^2 (Lambda + 1 / s^2).
bool LinearPosterior::solveWith(double scale) {
  logDeterminant_ = 0.0;
  for (int k = 0; k < rank_; ++k) {
    precision_[k] = ratio_ * lambda_[k] + 1.0 / square(scale);
    xi_[k] = y_[k];
  }
  if (!isDense_) {
    for (int k = 0; k < rank_; ++k) {
      xi_[k] /= precision_[k];
      logDeterminant_ += std::log(square(scale) * precision_[k]);
    }
    return true;
  }
  double* to = root_;
  for (int i = 0; i < rank_; ++i) {
    for (int j = 0; j <= i; ++j) *to++ = -ratio_ * taken_[std::ptrdiff_t{kMostRank} * i + j];
    to[-1] += precision_[i];
  }
  if (!factoriseLower(factor(), rank_, scratch_.data())) return false;
  solveLower(factor(), rank_, xi_.data());
  solveLowerTransposed(factor(), rank_, xi_.data());
  for (std::ptrdiff_t i = 0; i < rank_; ++i) logDeterminant_ += 2.0 * std::log(scale / root_[i * (i + 3) / 2]);
  return true;
}

/// Returns the likeliest s, as if what is missing in addition were what xi makes of it, at s = 1.
double LinearPosterior::likeliestScale() const {
  double best = 1.0, most = 0.0;
  for (int step = 0; step <= kMostSteps; ++step) {
    const double octaves = static_cast<double>(step) / kSteps, squared = std::exp2(2.0 * octaves);
    double sum = -square(octaves);
    for (int k = 0; k < rank_; ++k) {
      const double lambda = ratio_ * lambda_[k], y = xi_[k] * (lambda + 1.0);
      sum += square(y) / (lambda + 1.0 / squared) - std::log(1.0 + squared * lambda);
    }
    if (step > 0 && sum <= most) continue;
    most = sum;
    best = std::sqrt(squared);
  }
  return best;
}

double LinearPosterior::forceOfXi_N() const {
  return (wrench_.topRows<3>() * Eigen::VectorXd::Map(xi_.data(), rank_)).norm();
}

Wrench LinearPosterior::wrench() const {
  return wrench_ * Eigen::VectorXd::Map(xi_.data(), rank_);
}

void LinearPosterior::allForces_N(std::span<double> forces) const {
  std::fill(forces.begin(), forces.end(), 0.0);
  for (std::size_t i = 0; i < atoms_.size(); ++i) {
    Eigen::Vector3d::Map(forces.data() + 3 * Index{atoms_[i]}) = atomForce_N(i);
  }
}

void LinearPosterior::addExtraForces_N(std::span<double> forces) const {
  for (std::size_t point = 0; point + 1 < extraFirst_.size(); ++point) {
    for (std::size_t i = extraFirst_[point]; i < extraFirst_[point + 1]; ++i) {
      const double times = extra()[extraUnknowns_[i]];
      for (int axis = 0; axis < 3; ++axis) forces[3 * point + axis] += times * extraShares_[3 * i + axis];
    }
  }
}

void LinearPosterior::complete(std::span<const int> missing, std::span<const int> added,
                               std::span<float> displacement_px) const {
  const auto at = [&](int coordinate) -> float& { return displacement_px[coordinate]; };
  const auto xi = Eigen::VectorXd::Map(xi_.data(), rank_);
  for (Index i = 0; i < std::ssize(missing); ++i) {
    at(missing[i]) = static_cast<float>(noise_px_ * seenWhereMissing_.row(i).dot(xi));
  }
  for (const int coordinate : added) {
    double sum = 0.0;
    for (int k = 0; k < rank_; ++k) sum += double{rows_.row(k)[coordinate]} * xi_[k];
    at(coordinate) = static_cast<float>(square(noise_px_) * sum);
  }
}

void LinearPosterior::readColumn(const double* column_px, std::span<double> ofXi) const {
  multiplyRows(rows_, {everyRow_.data(), static_cast<std::size_t>(rank_)}, column_px, ofXi.data());
}

void LinearPosterior::subtractAt(int coordinate, double displacement_px, std::span<double> ofXi) const {
  for (int k = 0; k < rank_; ++k) ofXi[k] -= displacement_px * double{rows_.row(k)[coordinate]};
}

void LinearPosterior::multiplyCovariance(std::span<double> ofXi) const {
  if (isDense_) {
    solveLower(factor(), rank_, ofXi.data());
    solveLowerTransposed(factor(), rank_, ofXi.data());
    return;
  }
  for (int k = 0; k < rank_; ++k) ofXi[k] /= precision_[k];
}

}  // namespace tractiond::solve
