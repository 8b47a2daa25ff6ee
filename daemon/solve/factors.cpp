// The singular values and left vectors come from the eigenvectors of A A', A = W^1/2 H of the atoms: an eigenvalue is
// right within 1e-15 of the largest, so the faintest mode, about 1e-3 of the largest, within 1e-9 of itself.
//
// H, H'H and what they have in common with the motion must fit together better than single precision: the products are
// those of the rounded matrices. The modes are not: the faintest ones would lose four digits.
#include "daemon/solve/factors.h"

#include "sensor/elastic/linear_algebra.h"
#include "sensor/elastic/parallel.h"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cassert>
#include <cmath>

namespace tractiond::solve {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using sensor::elastic::Op;

/// Singular values below this share of the largest drown in the rounding of A A', whatever the options say.
constexpr double kSmallest = 1e-6;

void round(MatrixXd& matrix) {
  for (double& each : matrix.reshaped()) each = static_cast<float>(each);
}

/// The weight of displacements where the whole picture may move, W = (1 + P Q P' / n^2)^-1 = 1 - R D R'.
struct MotionWeight {
  MatrixXd axes;  ///< R, 2M x 4: the left singular vectors of P Q^1/2 / n; 0 for a motion that does not happen
  Eigen::Vector4d squares;  ///< of the singular values

  MotionWeight(const MotionPrior& motion, double noise_px)
      : axes(motion.modes * (motion.variances.cwiseSqrt() / noise_px).asDiagonal()) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> moved(axes.transpose() * axes);
    squares = moved.eigenvalues().cwiseMax(0.0);
    const Eigen::Vector4d reciprocal = (squares.array() > 0.0).select(squares.array().max(1e-300).rsqrt(), 0.0);
    axes = axes * (moved.eigenvectors() * reciprocal.asDiagonal());
  }

  /// Multiplies W^1/2 by a matrix of 2M rows, in place.
  void apply(MatrixXd& matrix) const {
    const Eigen::Vector4d share = 1.0 - (1.0 + squares.array()).rsqrt();
    matrix -= axes * share.asDiagonal() * (axes.transpose() * matrix);
  }
};

/// Influence of the wide atoms, those that come after the points, from that of the points.
MatrixXd ofWideAtoms(const MatrixXd& influence, const Atoms& atoms) {
  const Index first = atoms.pointCount();
  MatrixXd result = MatrixXd::Zero(influence.rows(), 3 * (atoms.count() - first));
  for (Index a = first; a < atoms.count(); ++a) {
    for (Eigen::SparseMatrix<double>::InnerIterator it(atoms.shape, a); it; ++it) {
      result.middleCols<3>(3 * (a - first)) += it.value() * influence.middleCols<3>(3 * it.row());
    }
  }
  return result;
}

/// H' of all atoms, rounded, from what the points and the wide atoms have.
RowMatrix influenceRows(const MatrixXd& influence, const MatrixXd& wide) {
  const Index points = influence.cols();
  RowMatrix rows(static_cast<int>(points + wide.cols()), static_cast<int>(influence.rows()));
  rows.view().topRows(points) = influence.transpose().cast<float>();
  rows.view().bottomRows(wide.cols()) = wide.transpose().cast<float>();
  return rows;
}

/// Rows first .. end - 1 of H', as columns.
MatrixXd columnsOf(const RowMatrix& rows, Index first, Index end) {
  return rows.view().middleRows(first, end - first).transpose().cast<double>();
}

/// The left singular vectors of A, and the squares of the singular values above `least`, rising. False: they were not
/// found.
/// \param points,
/// \param wide of A
bool allModes(const MatrixXd& points, const MatrixXd& wide, double least, MatrixXd& vectors, VectorXd& squares) {
  vectors.resize(points.rows(), points.rows());
  sensor::elastic::multiplyBySelf(1.0, points, Op::kPlain, 0.0, vectors);
  sensor::elastic::multiplyBySelf(1.0, wide, Op::kPlain, 1.0, vectors);
  return sensor::elastic::eigenvectorsAbove(least, vectors, squares);
}

/// The same among the combinations of the right singular vectors V of `near`, by the Gram matrix V'A'A V, which has as
/// few rows as there are modes.
/// \param points of A
bool amongModes(const MatrixXd& points, const Atoms& atoms, const Factors& near, double least, MatrixXd& vectors,
                VectorXd& squares) {
  // The forces of the modes on the points, those on wide atoms shared among the points.
  MatrixXd modes = columnsOf(near.right, 0, points.cols()), ofAtom(3, near.rank());
  for (int a = atoms.pointCount(); a < atoms.count(); ++a) {
    modesOfAtom(near, atoms, a, ofAtom);
    const MatrixXd columns = ofAtom.transpose();
    for (Eigen::SparseMatrix<double>::InnerIterator it(atoms.shape, a); it; ++it) {
      modes.middleCols<3>(3 * it.row()) += it.value() * columns;
    }
  }
  MatrixXd images(points.rows(), near.rank()), rotation(near.rank(), near.rank());
  sensor::elastic::multiply(1.0, points, Op::kPlain, modes, Op::kTransposed, 0.0, images);
  modes.resize(0, 0);
  sensor::elastic::multiplyBySelf(1.0, images, Op::kTransposed, 0.0, rotation);
  if (!sensor::elastic::eigenvectorsAbove(least, rotation, squares)) return false;
  vectors.resize(points.rows(), rotation.cols());
  sensor::elastic::multiply(1.0, images, Op::kPlain, rotation, Op::kPlain, 0.0, vectors);
  vectors *= squares.cwiseSqrt().cwiseInverse().asDiagonal();
  return true;
}

/// Computes Factors::gram and motionCoupling, some atoms at a time: all of them as matrices of doubles would take more
/// memory than the factors.
/// \param strays P Q^1/2
void multiplyInfluence(const MatrixXd& strays, Factors& factors) {
  constexpr Index kTogether = 128;  // atoms
  const Index count = factors.atomCount();
  factors.gram.resize(9 * count * (count + 1) / 2);
  factors.motionCoupling.resize(Eigen::NoChange, 3 * count);
  for (Index first = 0; first < count; first += kTogether) {
    const Index end = std::min(first + kTogether, count);
    const MatrixXd own = columnsOf(factors.influence, 3 * first, 3 * end);
    factors.motionCoupling.middleCols(3 * first, own.cols()) = strays.transpose() * own;
    sensor::elastic::inParallel((end + kTogether - 1) / kTogether, [&](Index part) {
      const Index other = part * kTogether;
      const MatrixXd others = columnsOf(factors.influence, 3 * other, 3 * std::min(other + kTogether, end));
      MatrixXd products(own.cols(), others.cols());
      sensor::elastic::multiply(1.0, own, Op::kTransposed, others, Op::kPlain, 0.0, products);
      for (Index a = first; a < end; ++a) {
        double* const row = factors.gram.data() + 9 * (a * (a + 1) / 2 + other);
        for (Index b = 0; b < std::min(kTogether, a + 1 - other); ++b) {
          Eigen::Map<Block>{row + 9 * b} = products.block<3, 3>(3 * (a - first), 3 * b);
        }
      }
    });
  }
}

}  // namespace

tl::expected<Factors, Error> computeFactors(MatrixXd influence, const Atoms& atoms, const MotionPrior& motion,
                                            double force_N, const SolveOptions& options, const Factors* near,
                                            const std::function<void()>& decomposing) {
  assert(influence.cols() == 3 * atoms.pointCount() && motion.modes.rows() == influence.rows());
  assert(options.noise_px > 0.0 && force_N > 0.0);
  if (!influence.allFinite() || influence.isZero(0.0)) {
    return tl::unexpected(Error{EX_CONFIG, "the influence matrix is not finite or all zero", "the gel and camera",
                                "check their sizes, Young's modulus and Poisson's ratio"});
  }
  Factors factors;
  factors.force_N = force_N;
  if (near != nullptr) {
    factors.systematicErrors = near->systematicErrors;
    factors.computed_ns = near->computed_ns;
  }
  MatrixXd wide = ofWideAtoms(influence, atoms);
  MatrixXd strays = motion.modes * motion.variances.cwiseSqrt().asDiagonal();
  factors.influence = influenceRows(influence, wide);
  factors.motion = toRows(strays.transpose());
  round(strays);
  multiplyInfluence(strays, factors);
  factors.motionGram = strays.transpose() * strays;

  const MotionWeight weight(motion, options.noise_px);
  weight.apply(influence);
  if (near == nullptr) weight.apply(wide);
  if (decomposing) decomposing();
  MatrixXd vectors;
  VectorXd squares;  // rising
  const double least = square(options.faintest * options.noise_px / force_N);
  if (!(near != nullptr ? amongModes(influence, atoms, *near, least, vectors, squares)
                        : allModes(influence, wide, least, vectors, squares))) {
    return tl::unexpected(Error{EX_SOFTWARE, "the influence matrix's eigenvectors were not found", "", ""});
  }
  for (Index i = squares.size() - 1; i >= 0 && squares[i] > square(kSmallest) * squares[squares.size() - 1]; --i) {
    factors.singularValues.push_back(std::sqrt(squares[i]));
  }
  const auto rank = static_cast<Index>(factors.singularValues.size());
  if (rank == 0) {
    return tl::unexpected(Error{EX_CONFIG, "even the most visible forces drown in the markers' noise",
                                "the gel and camera", "check their sizes, Young's modulus and solve.noise_px"});
  }
  const VectorXd s = VectorXd::Map(factors.singularValues.data(), rank);
  MatrixXd left = vectors.rightCols(rank).rowwise().reverse();
  vectors.resize(0, 0);
  // V = (W^1/2 H)' U S^-1 of the points.
  MatrixXd right(influence.cols(), rank);
  sensor::elastic::multiply(1.0, influence, Op::kTransposed, left, Op::kPlain, 0.0, right);
  factors.right = toRows(right * s.cwiseInverse().asDiagonal());
  weight.apply(left);
  MatrixXd both(left.rows(), kMotions + rank);
  both << weight.axes, left;
  factors.left = toRows(both);
  factors.motionGain = weight.squares.array() / (1.0 + weight.squares.array());
  return factors;
}

tl::expected<Factors, Error> computeFactors(const sensor::Sensor& sensor, const Atoms& atoms,
                                            const SolveOptions& options, const Steps& steps) {
  using sensor::elastic::displacementMatrix;
  const auto begin = [&](Step step, double done) {
    if (steps) steps(step, done);
  };
  const auto progress = [&](double done) { begin(Step::kInfluence, done); };
  MatrixXd influence = sensor::elastic::toImage(
      sensor, sensor.body ? displacementMatrix(sensor, options.model, progress)
                          : displacementMatrix(sensor.gel, options.model, sensor::markerPositions(sensor), atoms.points,
                                               sensor::elastic::kBlockDegree, progress));
  begin(Step::kProducts, 0.0);
  return computeFactors(std::move(influence), atoms, motionPrior(sensor),
                        sensor.gel.youngsModulus * square(sensor.nodes.pitch), options, nullptr,
                        [&] { begin(Step::kModes, 0.0); });
}

void modesOfAtom(const Factors& factors, const Atoms& atoms, int atom, Eigen::MatrixXd& rows) {
  rows.setZero();
  for (Eigen::SparseMatrix<double>::InnerIterator it(atoms.shape, atom); it; ++it) {
    rows += it.value() * factors.right.view().middleRows<3>(3 * it.row()).cast<double>();
  }
}

MotionPrior motionPrior(const sensor::Sensor& sensor) {
  const sensor::PictureMotion& motion = sensor.pictureMotion;
  return {sensor::elastic::pictureMotionMatrix(sensor),
          Eigen::Vector4d(motion.shift_px, motion.shift_px, motion.scale, motion.roll).cwiseAbs2()};
}

}  // namespace tractiond::solve
