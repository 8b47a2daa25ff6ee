// Posteriors as linear functions of a picture, and the test of what they leave, against the formulae written densely.
#include "daemon/solve/linear_posterior.h"
#include "daemon/solve/residual_test.h"
#include "tests/unit/solve/linear_bench.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <memory>
#include <random>
#include <stdexcept>
#include <utility>

namespace tractiond::solve {
namespace {

/// Atoms with priors, columns that have nothing to do with the gel, and a picture that lacks markers: a posterior to
/// make a linear one from; and what linear_posterior.h says, in covariance form.
class LinearProblem {
 public:
  static constexpr int kExtra = 5;

  /// \param size_N of the roots of the atoms' priors
  LinearProblem(std::vector<int> atoms, double size_N, bool lacksMarkers = true)
      : most_(static_cast<int>(atoms.size()))
      , missing_(lacksMarkers ? missingOf(bench_.sensor()) : std::vector<int>{})
      , displacement_(static_cast<std::size_t>(bench_.factors().influence.stride()))
      , extra_(bench_.factors(), bench_.atoms(), kExtra)
      , posterior_(bench_.factors(), bench_.atoms(), most_, kExtra)
      , products_(bench_.factors(), most_) {
    chosen_.atoms = std::move(atoms);
    for (std::size_t i = 0; i < chosen_.atoms.size(); ++i) {
      const Block root = size_N * (Block::Identity() + 0.5 * Block::NullaryExpr([&] { return normal_(generator_); }));
      chosen_.covariance_N2.emplace_back(root * root.transpose());
      chosen_.gamma_N2.push_back(chosen_.covariance_N2.back().trace() / 3.0);
    }
    writeDensely();
    const Displacements first = take(draw(kNoise_px), missing_, kNoise_px);
    extra_.begin(kExtra);
    for (int e = 0; e < kExtra; ++e) {
      const VectorXd column = B_.col(firstExtra() + e);
      extra_.setDisplacement(e, column.data(), 1.0);
      VectorXd::Map(extra_.pointForces_N(e).data(), toPoints_.rows()) = toPoints_.col(firstExtra() + e);
      extra_.wrench(e) = toWrench_.col(firstExtra() + e);
    }
    extra_.multiply(first);
    products_.begin(first);
    if (!posterior_.fit(first, products_, chosen_, &extra_)) throw std::runtime_error("no posterior");
    for (int c = 0; c < curves_.rows(); ++c) {
      for (int i = 0; i < curves_.columns(); ++i) curves_.row(c)[i] = static_cast<float>(0.1 * normal_(generator_));
    }
  }

  /// Returns a linear posterior of the picture.
  std::unique_ptr<LinearPosterior> make(double force_N) {
    auto linear = std::make_unique<LinearPosterior>(bench_.factors(), bench_.atoms(), most_, kExtra);
    if (!linear->make(posterior_, products_, missing_, force_N, curves_, scratch_))
      throw std::runtime_error("no linear posterior");
    return linear;
  }

  /// Returns a picture to which so much of each curve is added.
  VectorXd withCurves(VectorXd picture) const {
    for (int c = 0; c < curves_.rows(); ++c) {
      picture +=
          kTimes[static_cast<std::size_t>(c)] * Eigen::VectorXf::Map(curves_.row(c), picture.size()).cast<double>();
    }
    return picture;
  }

  /// Answers a picture to which so much of each curve is added first.
  bool answer(LinearPosterior& linear, const Displacements& picture, const std::vector<int>& added) const {
    LineArray<double> bent(static_cast<std::size_t>(curves_.stride()));
    VectorXd::Map(bent.data(), curves_.columns()) =
        withCurves(VectorXd::Map(picture.displacement_px, curves_.columns()));
    for (const int coordinate : picture.missing) bent.data()[coordinate] = 0.0;
    if (!linear.read(bent.data(), picture.noise_px, added, curves_) || !linear.solve(kTimes)) return false;
    linear.weigh(picture.squares_px2);
    return true;
  }
  const RowMatrix& curves() const { return curves_; }
  static constexpr std::array<double, 2> kTimes = {0.5, -1.5};

  /// Returns the displacements of forces that are drawn from the prior, with noise.
  VectorXd draw(double noise_px, double scale = 1.0) {
    const VectorXd theta = VectorXd::NullaryExpr(unknowns(), [&] { return scale * normal_(generator_); });
    return B_ * (R_ * theta) + VectorXd::NullaryExpr(B_.rows(), [&] { return noise_px * normal_(generator_); });
  }

  /// Returns a picture. Valid until the next one.
  Displacements take(const VectorXd& displacement_px, const std::vector<int>& missing, double noise_px) {
    std::copy(displacement_px.begin(), displacement_px.end(), displacement_.data());
    for (const int coordinate : missing) displacement_.data()[coordinate] = 0.0;
    const double squares = VectorXd::Map(displacement_.data(), B_.rows()).squaredNorm();
    return {displacement_.data(), missing, squares, noise_px};
  }

  struct Dense {
    VectorXd mean;
    MatrixXd covariance;
    double evidence = 0.0, squares_px2 = 0.0, misfit = 0.0;
  };
  /// Returns the posterior of the unknowns. \param scale of the prior's deviations
  Dense solve(const VectorXd& displacement_px, const std::vector<int>& missing, double noise_px, double scale) const {
    const std::vector<int> present = bench_.presentOf(missing);
    const MatrixXd B = B_(present, Eigen::all), prior = scale * scale * R_ * R_.transpose();
    const VectorXd d = displacement_px(present);
    const double n2 = noise_px * noise_px;
    const Eigen::LLT<MatrixXd> total(B * prior * B.transpose() + n2 * MatrixXd::Identity(B.rows(), B.rows()));
    const MatrixXd gain = total.solve(B * prior).transpose();
    const double logDeterminant = 2.0 * VectorXd(MatrixXd(total.matrixL()).diagonal()).array().log().sum();
    Dense result{gain * d, prior - gain * B * prior};
    result.squares_px2 = (d - B * result.mean).squaredNorm();
    result.misfit = d.dot(total.solve(d));
    result.evidence = -0.5 * (logDeterminant - static_cast<double>(d.size()) * std::log(n2) + result.misfit);
    return result;
  }

  Bench& bench() { return bench_; }
  const std::vector<int>& missing() const { return missing_; }
  const ExtraUnknowns& extra() const { return extra_; }
  Index firstExtra() const { return 3 * Index{most_}; }
  Index unknowns() const { return firstExtra() + kExtra + kMotions; }
  const MatrixXd& displacements() const { return B_; }  ///< by the unknowns, 2M x unknowns
  const MatrixXd& root() const { return R_; }           ///< of the prior
  const MatrixXd& toPoints() const { return toPoints_; }
  const MatrixXd& toWrench() const { return toWrench_; }
  MatrixXd toNodes() const {
    MatrixXd sum = MatrixXd::Zero(3 * bench_.atoms().nodeCount(), toPoints_.rows());
    for (int p = 0; p < bench_.atoms().pointCount(); ++p)
      sum.block<3, 3>(3 * bench_.atoms().nodeOf(p), 3 * p).setIdentity();
    return sum * toPoints_;
  }

 private:
  void writeDensely() {
    const MatrixXd every = bench_.atomInfluence(), shape = bench_.atoms().shape;
    const Index points = shape.rows(), coordinates = every.rows();
    B_.resize(coordinates, unknowns());
    R_.setIdentity(unknowns(), unknowns());
    toPoints_.setZero(3 * points, unknowns());
    toWrench_.setZero(6, unknowns());
    const auto random = [&](double size) { return [this, size] { return size * normal_(generator_); }; };
    for (Index i = 0; i < most_; ++i) {
      const auto index = static_cast<std::size_t>(i);
      B_.middleCols<3>(3 * i) = every.middleCols<3>(3 * chosen_.atoms[index]);
      R_.block<3, 3>(3 * i, 3 * i) = MatrixXd(Eigen::LLT<MatrixXd>(chosen_.covariance_N2[index]).matrixL());
      for (Index p = 0; p < points; ++p) {
        toPoints_.block<3, 3>(3 * p, 3 * i).diagonal().setConstant(shape(p, chosen_.atoms[index]));
      }
    }
    for (Index i = 0; i < 3 * points; ++i) {
      const Vector3d unit = Vector3d::Unit(i % 3), at = bench_.atoms().points.col(i / 3);
      toWrench_.topRows<3>() += unit * toPoints_.row(i);
      toWrench_.bottomRows<3>() += at.cross(unit) * toPoints_.row(i);
    }
    B_.middleCols<kExtra>(firstExtra()) = MatrixXd::NullaryExpr(coordinates, kExtra, random(0.1));
    for (const int coordinate : missing_) B_.block<1, kExtra>(coordinate, firstExtra()).setZero();
    B_.rightCols<kMotions>() = bench_.strays();
    toPoints_.middleCols<kExtra>(firstExtra()) = 0.1 * MatrixXd::NullaryExpr(3 * points, kExtra, random(0.1));
    toWrench_.middleCols<kExtra>(firstExtra()) = MatrixXd::NullaryExpr(6, kExtra, random(0.1));
  }

  std::mt19937_64 generator_{11};
  std::normal_distribution<double> normal_;
  Bench bench_{smallSensor()};
  int most_;
  std::vector<int> missing_;
  LineArray<double> displacement_;
  RowMatrix curves_{static_cast<int>(kTimes.size()), bench_.factors().coordinateCount()};
  ExtraUnknowns extra_;
  Posterior posterior_;
  AtomProducts products_;
  Chosen chosen_;
  LinearScratch scratch_;
  MatrixXd B_, R_, toPoints_, toWrench_;
};

/// Atoms of all sizes, apart from each other.
const std::vector<int> kFewAtoms = {40, 3, 85, 118, 60, 131};

std::vector<int> unionOf(const std::vector<int>& a, const std::vector<int>& b) {
  std::vector<int> result;
  std::set_union(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(result));
  return result;
}

std::vector<int> differenceOf(const std::vector<int>& a, const std::vector<int>& b) {
  std::vector<int> result;
  std::set_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(result));
  return result;
}

/// What a posterior tells of the functionals of the unknowns that users see.
struct Told {
  VectorXd mean, deviation;
};

Told toldBy(LinearPosterior& linear, const Atoms& atoms) {
  std::array<double, 36> ofWrench{};
  linear.wrenchCovariance(ofWrench);
  VectorXd nodes(3 * atoms.nodeCount());
  linear.nodeDeviations_N(all(nodes));
  const auto [weights, points] = functionals(atoms);
  RowMajor ofFunctionals(kColumns, kColumns), ofExtra(LinearProblem::kExtra, LinearProblem::kExtra);
  linear.covariance(all(weights), points, all(ofFunctionals));
  const std::vector<int> every = everyPoint(LinearProblem::kExtra);
  linear.extraCovariance(every, all(ofExtra));
  std::vector<double> forces(3 * static_cast<std::size_t>(atoms.count()));
  VectorXd ofPoints(3 * atoms.pointCount());
  linear.allForces_N(forces);
  addUp(atoms, forces, all(ofPoints));
  linear.addExtraForces_N(all(ofPoints));
  VectorXd ofNodes(nodes.size());
  addAtNodes(atoms, {ofPoints.data(), static_cast<std::size_t>(ofPoints.size())}, all(ofNodes));
  Told told;
  told.mean.resize(6 + nodes.size() + kColumns + ofExtra.rows());
  told.deviation.resize(told.mean.size());
  told.mean << VectorXd::Map(linear.wrench().data(), 6), ofNodes, weights.transpose() * ofPoints,
      VectorXd::Map(linear.extra().data(), LinearProblem::kExtra);
  told.deviation << MatrixXd::Map(ofWrench.data(), 6, 6).diagonal().cwiseSqrt(), nodes,
      ofFunctionals.diagonal().cwiseSqrt(), ofExtra.diagonal().cwiseSqrt();
  return told;
}

Told toldBy(const LinearProblem& problem, const LinearProblem::Dense& dense, const Atoms& atoms) {
  const MatrixXd nodes = problem.toNodes(), ofFunctionals = functionals(atoms).first.transpose() * problem.toPoints();
  MatrixXd to = MatrixXd::Zero(6 + nodes.rows() + kColumns + LinearProblem::kExtra, problem.unknowns());
  to << problem.toWrench(), nodes, ofFunctionals,
      MatrixXd::Identity(problem.unknowns(), problem.unknowns())
          .middleRows<LinearProblem::kExtra>(problem.firstExtra());
  return {to * dense.mean, (to * dense.covariance * to.transpose()).diagonal().cwiseSqrt()};
}

/// Returns the likeliest scale by the evidence, as linear_posterior.h has it.
double likeliestScale(const LinearProblem& problem, const VectorXd& picture, const std::vector<int>& missing,
                      double noise_px) {
  double best = 1.0, most = -std::numeric_limits<double>::infinity();
  for (int step = 0; step <= 5; ++step) {
    const double octaves = step / 4.0;
    const double worth =
        problem.solve(picture, missing, noise_px, std::exp2(octaves)).evidence - 0.5 * octaves * octaves;
    if (worth > most) best = std::exp2(octaves);
    most = std::max(most, worth);
  }
  return best;
}

/// Units in which single precision shows: of the linear posterior's rows, times the picture, in deviations. It has
/// 6e-8, times some tens where rows cancel out.
constexpr double kRounded = 5e-6;

/// Where the picture sees every direction nothing is left out but digits.
TEST(LinearPosterior, IsThePosteriorOfALaterPicture) {
  LinearProblem problem(kFewAtoms, 0.5);
  const Atoms& atoms = problem.bench().atoms();
  const std::vector<int> others = everySeventh(problem.bench().factors().coordinateCount()),
                         both = unionOf(problem.missing(), others), added = differenceOf(others, problem.missing());
  ASSERT_GT(added.size(), 10U);
  ASSERT_GT(problem.missing().size() + others.size(), both.size());
  struct Case {
    const char* name;
    double noise_px, draw;
    bool isAdded;
    double grown;  // the force, as a multiple of that then; 0: it is smaller
  };
  for (const auto& [name, noise_px, draw, isAdded, grown] :
       {Case{"as it was", kNoise_px, 1.0, false, 0.0}, Case{"more noise", 1.7 * kNoise_px, 1.0, false, 0.0},
        Case{"less noise", 0.6 * kNoise_px, 1.0, false, 0.0}, Case{"other markers", kNoise_px, 1.0, true, 0.0},
        Case{"a larger force", kNoise_px, 1.0, false, 1.8},
        Case{"larger forces by the picture alone", kNoise_px, 3.0, false, 0.0},
        Case{"all at once", 1.7 * kNoise_px, 1.0, true, 1.8}}) {
    SCOPED_TRACE(name);
    const std::vector<int>& missing = isAdded ? both : problem.missing();
    const VectorXd picture = problem.draw(noise_px, draw);
    const double force_N = (problem.toWrench() * problem.solve(picture, missing, noise_px, 1.0).mean).head<3>().norm();
    const auto linear = problem.make(grown > 0.0 ? force_N / grown : 10.0 * force_N);
    ASSERT_EQ(linear->rank(), problem.unknowns());
    const Displacements given = problem.take(picture, missing, noise_px);
    ASSERT_TRUE(problem.answer(*linear, given, isAdded ? added : std::vector<int>{}));

    const double likeliest = likeliestScale(problem, picture, missing, noise_px);
    EXPECT_EQ(likeliest > 2.0, draw > 2.0);
    EXPECT_NEAR(linear->scale(), std::max(likeliest, grown), 1e-4);
    const LinearProblem::Dense dense = problem.solve(picture, missing, noise_px, linear->scale());
    const Told found = toldBy(*linear, atoms), expected = toldBy(problem, dense, atoms);
    const double rounded = kRounded * std::sqrt(given.squares_px2) / noise_px;
    for (Index i = 0; i < found.mean.size(); ++i) {
      EXPECT_NEAR(found.deviation[i], expected.deviation[i], 1e-2 * expected.deviation[i]) << i;
      EXPECT_NEAR(found.mean[i], expected.mean[i], rounded * expected.deviation[i]) << i;
    }
    for (Index m = 0; m < kMotions; ++m) {
      const Index at = problem.unknowns() - kMotions + m;
      EXPECT_NEAR(linear->motion()[static_cast<std::size_t>(m)], dense.mean[at],
                  rounded * std::sqrt(dense.covariance(at, at)));
    }
    const double octaves = std::log2(linear->scale()), cancelled = 1e-7 * given.squares_px2 / (noise_px * noise_px);
    EXPECT_NEAR(linear->misfit(), dense.misfit, cancelled);
    EXPECT_NEAR(linear->logEvidence(), dense.evidence - 0.5 * octaves * octaves, cancelled);
    EXPECT_NEAR(linear->squaredResidual_px2(), dense.squares_px2, 2.0 * noise_px * noise_px * cancelled);
    std::vector<float> completed(static_cast<std::size_t>(picture.size()));
    linear->complete(problem.missing(), added, completed);
    for (const int coordinate : both) {
      EXPECT_NEAR(completed[static_cast<std::size_t>(coordinate)],
                  problem.displacements().row(coordinate).dot(dense.mean), rounded * noise_px)
          << coordinate;
    }
  }
}

/// Let G = Q Lambda Q' + E be what the picture tells of theta, E what linear_posterior.h calls little, and e the
/// largest eigenvalue of E. Without E no deviation is narrower, and none is wider by more than a factor of
/// sqrt(1 + e), as 1 + G is at most (1 + e) (1 + Q Lambda Q'). The means of a picture that the model draws then differ
/// by deviations whose squares are the differences of the variances.
TEST(LinearPosterior, LeavesFaintDirectionsToThePrior) {
  std::vector<int> many;
  for (int a = 0; a < 132; a += 2) many.push_back(a);
  LinearProblem problem(many, 0.01);
  const Atoms& atoms = problem.bench().atoms();
  const auto linear = problem.make(1e6);
  EXPECT_LT(linear->rank(), problem.unknowns() / 2);

  const MatrixXd Q = linear->unknownsOfXi().transpose();
  const MatrixXd seen =
      (problem.displacements() * problem.root())(problem.bench().presentOf(problem.missing()), Eigen::all) / kNoise_px;
  const MatrixXd faint =
      seen.transpose() * seen - Q * VectorXd::Map(linear->lambda().data(), linear->rank()).asDiagonal() * Q.transpose();
  const double largest = Eigen::SelfAdjointEigenSolver<MatrixXd>(faint).eigenvalues().tail<1>()[0];
  EXPECT_LT(largest, 0.5);

  for (int time = 0; time < 4; ++time) {
    const VectorXd picture = problem.draw(kNoise_px);
    const Displacements given = problem.take(picture, problem.missing(), kNoise_px);
    ASSERT_TRUE(problem.answer(*linear, given, {}));
    const LinearProblem::Dense dense = problem.solve(picture, problem.missing(), kNoise_px, linear->scale());
    const Told found = toldBy(*linear, atoms), expected = toldBy(problem, dense, atoms);
    const double rounded = kRounded * std::sqrt(given.squares_px2) / kNoise_px;
    for (Index i = 0; i < found.mean.size(); ++i) {
      EXPECT_GE(found.deviation[i], (1.0 - 1e-3) * expected.deviation[i]) << i;
      EXPECT_LE(found.deviation[i], (1.0 + 1e-3) * std::sqrt(1.0 + largest) * expected.deviation[i]) << i;
      const double narrowed = std::sqrt(
          std::max(0.0, found.deviation[i] * found.deviation[i] - expected.deviation[i] * expected.deviation[i]));
      EXPECT_NEAR(found.mean[i], expected.mean[i], 4.5 * narrowed + (rounded + 1e-3) * expected.deviation[i]) << i;
    }
    EXPECT_NEAR(linear->logEvidence(), dense.evidence, 4.0 * std::sqrt(faint.trace()));
  }
}

/// b' K^-1 b of all atoms, densely. \param one what the posterior leaves of a picture, and its covariance
double surestOf(const Bench& bench, const MatrixXd& B, const VectorXd& left_px, const MatrixXd& known) {
  const MatrixXd one = MatrixXd::Identity(B.rows(), B.rows()), strays = bench.strays(), H = bench.atomInfluence();
  const double n2 = kNoise_px * kNoise_px;
  const MatrixXd weight = (one + strays * strays.transpose() / n2).inverse();
  // Of the forces alone: the picture's motion is marginal in the weights.
  const MatrixXd matched = H.transpose() * weight, whole = matched * H;
  const MatrixXd covariance = whole - matched * B * known * B.transpose() * matched.transpose() / n2;
  const VectorXd b = matched * left_px / kNoise_px;
  double most = 0.0;
  for (Index a = 0; a < H.cols(); a += 3) {
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(covariance.block<3, 3>(a, a));
    double sum = 0.0;
    for (Index k = 0; k < 3; ++k) {
      if (eigen.eigenvalues()[k] < 1e-3 * whole.block<3, 3>(a, a).trace()) continue;  // explained wholly
      const double along = eigen.eigenvectors().col(k).dot(b.segment<3>(a));
      sum += along * along / eigen.eigenvalues()[k];
    }
    most = std::max(most, sum);
  }
  return std::sqrt(most);
}

/// Pictures that the model draws do not contradict it: of A atoms the surest force then exceeds, in one of a hundred,
/// the deviations that chi^2 of three degrees exceeds in one of 100 A; as the atoms are like each other, less often.
TEST(ResidualTest, HasTheSpreadThatIsStated) {
  LinearProblem problem(kFewAtoms, 0.5, false);
  Bench& bench = problem.bench();
  const auto linear = problem.make(1e6);
  const auto modes = std::make_shared<const AtomModes>(bench.factors(), bench.atoms(), bench.factors().rank());
  ResidualTest test(bench.factors(), modes, static_cast<int>(problem.unknowns()), problem.curves().rows());
  test.make(*linear, &problem.extra(), problem.curves());
  constexpr double kOnePercent = 4.68;  // of chi with three degrees: 1e-2 / 142 are above
  ASSERT_EQ(bench.atoms().count(), 142);
  std::vector<double> surest;
  while (surest.size() < 300) {
    const VectorXd picture = problem.draw(kNoise_px);
    ASSERT_TRUE(problem.answer(*linear, problem.take(picture, {}, kNoise_px), {}));
    if (linear->scale() > 1.0) continue;  // K is that of s = 1
    test.begin(rounded(problem.withCurves(picture)));
    surest.push_back(test.surest(*linear, LinearProblem::kTimes, kNoise_px));
    if (surest.size() > 10) continue;
    const LinearProblem::Dense dense = problem.solve(picture, {}, kNoise_px, 1.0);
    const Index forces = problem.unknowns() - kMotions;
    const MatrixXd B = problem.displacements().leftCols(forces);
    const double expected =
        surestOf(bench, B, picture - B * dense.mean.head(forces), dense.covariance.topLeftCorner(forces, forces));
    EXPECT_NEAR(surest.back(), expected, 2e-3 * expected);
  }
  std::sort(surest.begin(), surest.end());
  EXPECT_LT(surest[surest.size() * 98 / 100], kOnePercent);
  EXPECT_GT(surest[surest.size() / 2], 2.0);
}

}  // namespace
}  // namespace tractiond::solve
