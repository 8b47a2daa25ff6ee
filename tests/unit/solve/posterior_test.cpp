// What the model of contacts solves and completes, against the formulae written densely.
#include "daemon/solve/wrench.h"
#include "tests/unit/solve/model_bench.h"

#include <gtest/gtest.h>

#include <random>

namespace tractiond::solve {
namespace {

TEST(AtomProducts, AreTheSameAfterOthersWereForgotten) {
  Bench bench(smallSensor());
  const std::vector<int> missing = missingOf(smallSensor());
  LineArray<double> displacement(bench.factors().influence.stride());
  std::copy_n(bench.picture({{1, 2, kPress}}, 8).data(), bench.factors().coordinateCount(), displacement.data());
  for (const int i : missing) displacement.data()[i] = 0.0;
  const Displacements given{displacement.data(), missing, 1.0, kNoise_px, {}};
  AtomProducts few(bench.factors(), 4), all(bench.factors(), 10);
  few.begin(given);
  all.begin(given);
  for (const std::vector<int>& atoms : {std::vector<int>{3, 40, 85}, {3, 41, 118}, {40, 60, 91, 131}}) {
    few.add(atoms);
    all.add(atoms);
    for (const int a : atoms) {
      for (int axis = 0; axis < 3; ++axis) {
        const int i = few.indexOf(a) + axis, j = all.indexOf(a) + axis;
        EXPECT_NEAR(few.withPicture(i), all.withPicture(j), 1e-9 * std::abs(all.withPicture(j)));
        const double largest = all.row(j)[j];
        for (int m = 0; m < kMotions; ++m) EXPECT_NEAR(few.row(i)[m], all.row(j)[m], 1e-9 * largest);
        for (const int b : atoms) {
          for (int other = 0; other < 3; ++other) {
            EXPECT_NEAR(few.row(i)[few.indexOf(b) + other], all.row(j)[all.indexOf(b) + other], 1e-9 * largest);
          }
        }
      }
    }
  }
}

/// Columns that have nothing to do with the gel, where coordinates are missing.
TEST(Posterior, CountsExtraUnknowns) {
  Bench bench(smallSensor());
  const std::vector<int> missing = missingOf(smallSensor()), present = bench.presentOf(missing);
  const Eigen::Index points = 3 * bench.atoms().pointCount(), coordinates = bench.influence().rows();
  constexpr int kExtra = 11;
  std::mt19937_64 generator(7);
  std::normal_distribution<double> normal;
  Chosen chosen{.atoms = {40, 3, 85, 118, 41}, .gamma_N2 = {}, .covariance_N2 = {}};
  for (std::size_t i = 0; i < chosen.atoms.size(); ++i) {
    chosen.covariance_N2.emplace_back((0.01 + 0.02 * static_cast<double>(i)) * Block::Identity());
    chosen.gamma_N2.push_back(chosen.covariance_N2.back()(0, 0));
  }
  MatrixXd columns = MatrixXd::NullaryExpr(coordinates, kExtra, [&] { return 0.1 * normal(generator); });
  for (const int i : missing) columns.row(i).setZero();
  const MatrixXd toPoints = MatrixXd::NullaryExpr(points, kExtra, [&] { return normal(generator); });
  const MatrixXd toWrench = MatrixXd::NullaryExpr(6, kExtra, [&] { return normal(generator); });

  VectorXd picture = bench.picture({{1, 2, kPress}}, 8) + 0.7 * columns.col(2) - 1.3 * columns.col(9);
  for (const int i : missing) picture[i] = 0.0;
  LineArray<double> displacement(bench.factors().influence.stride());
  std::copy_n(picture.data(), coordinates, displacement.data());
  const Displacements given{displacement.data(), missing, picture.squaredNorm(), kNoise_px, {}};
  ExtraUnknowns extra(bench.factors(), bench.atoms(), 16);
  extra.begin(kExtra);
  for (int i = 0; i < kExtra; ++i) {
    const VectorXd half = 2.0 * columns.col(i);
    extra.setDisplacement(i, half.data(), 0.5);
    Eigen::Map<VectorXd>(extra.pointForces_N(i).data(), points) = toPoints.col(i);
    extra.wrench(i) = toWrench.col(i);
  }
  extra.multiply(given);
  Posterior posterior(bench.factors(), bench.atoms(), 10, 16);
  AtomProducts products(bench.factors(), 10);
  products.begin(given);
  ASSERT_TRUE(posterior.fit(given, products, chosen, &extra));

  // Everything in covariance form.
  const Eigen::Index atoms = 3 * static_cast<Eigen::Index>(chosen.atoms.size()), size = atoms + kExtra + kMotions;
  const MatrixXd influence = bench.atomInfluence(), shape = bench.atoms().shape;
  MatrixXd B(coordinates, size), prior = MatrixXd::Identity(size, size), to = MatrixXd::Zero(points, size);
  for (std::size_t i = 0; i < chosen.atoms.size(); ++i) {
    const Eigen::Index at = 3 * static_cast<Eigen::Index>(i);
    B.middleCols<3>(at) = influence.middleCols<3>(3 * chosen.atoms[i]);
    prior.block<3, 3>(at, at) = chosen.covariance_N2[i];
    for (Eigen::Index p = 0; p < shape.rows(); ++p) {
      to.block<3, 3>(3 * p, at).diagonal().setConstant(shape(p, chosen.atoms[i]));
    }
  }
  B.middleCols(atoms, kExtra) = columns;
  B.rightCols<kMotions>() = bench.strays();
  to.middleCols(atoms, kExtra) = toPoints;
  const MatrixXd seen = B(present, Eigen::all);
  const double n2 = kNoise_px * kNoise_px;
  const MatrixXd total = seen * prior * seen.transpose() + n2 * MatrixXd::Identity(seen.rows(), seen.rows());
  const Eigen::LLT<MatrixXd> factor(total);
  const MatrixXd gain = prior * seen.transpose() * factor.solve(MatrixXd::Identity(seen.rows(), seen.rows()));
  const VectorXd d = picture(present), mean = gain * d;
  const MatrixXd sigma = prior - gain * seen * prior;

  EXPECT_LT((VectorXd::Map(posterior.extra().data(), kExtra) - mean.segment(atoms, kExtra)).norm(), 1e-4);
  MatrixXd forces(3, shape.cols());
  posterior.allForces_N({forces.data(), static_cast<std::size_t>(forces.size())});
  const MatrixXd ofChosen = forces(Eigen::all, chosen.atoms);
  EXPECT_LT((ofChosen.reshaped() - mean.head(atoms)).norm(), 1e-5);
  EXPECT_NEAR(posterior.squaredResidual_px2(), (d - seen * mean).squaredNorm(), 1e-5);
  const double logDeterminant = 2.0 * VectorXd(MatrixXd(factor.matrixL()).diagonal()).array().log().sum();
  const double evidence =
      -0.5 * (logDeterminant - static_cast<double>(d.size()) * std::log(n2) + d.dot(factor.solve(d)));
  EXPECT_NEAR(posterior.logEvidence(), evidence, 1e-5 * std::abs(evidence));

  MatrixXd covariance(kExtra, kExtra);
  posterior.extraCovariance({covariance.data(), static_cast<std::size_t>(covariance.size())});
  const MatrixXd expected = sigma.block(atoms, atoms, kExtra, kExtra);
  EXPECT_LT((covariance - expected).norm(), 1e-4 * expected.norm());

  MatrixXd wrenches = MatrixXd::Zero(6, size);
  for (int p = 0; p < bench.atoms().pointCount(); ++p) {
    wrenches += unitWrenches(bench.atoms().points.col(p)) * to.middleRows<3>(3 * p);
  }
  wrenches.middleCols(atoms, kExtra) = toWrench;
  std::array<double, 36> found{};
  posterior.wrenchCovariance(found);
  const MatrixXd wrenchCovariance = wrenches * sigma * wrenches.transpose();
  EXPECT_LT((MatrixXd::Map(found.data(), 6, 6) - wrenchCovariance).norm(), 1e-4 * wrenchCovariance.norm());
  EXPECT_LT((VectorXd::Map(posterior.wrench().data(), 6) - wrenches * mean).norm(), 1e-3);

  Eigen::Matrix<double, Eigen::Dynamic, kColumns, Eigen::RowMajor> weights =
      MatrixXd::NullaryExpr(points, kColumns, [&] { return normal(generator); });
  MatrixXd ofFunctionals(kColumns, kColumns);
  posterior.covariance({weights.data(), static_cast<std::size_t>(weights.size())}, every(static_cast<int>(points) / 3),
                       {ofFunctionals.data(), static_cast<std::size_t>(ofFunctionals.size())});
  const MatrixXd ofPoints = to * sigma * to.transpose(), functionals = weights.transpose() * ofPoints * weights;
  EXPECT_LT((ofFunctionals - functionals).norm(), 1e-4 * functionals.norm());
  MatrixXd toNodes = MatrixXd::Zero(3 * bench.atoms().nodeCount(), points);
  for (int p = 0; p < bench.atoms().pointCount(); ++p) {
    toNodes.block<3, 3>(3 * bench.atoms().nodeOf(p), 3 * p).setIdentity();
  }
  VectorXd deviations(toNodes.rows());
  posterior.nodeDeviations_N({deviations.data(), static_cast<std::size_t>(deviations.size())});
  const VectorXd ofNodes = (toNodes * ofPoints * toNodes.transpose()).diagonal().cwiseSqrt();
  EXPECT_LT((deviations - ofNodes).cwiseAbs().maxCoeff(), 1e-4 * ofNodes.maxCoeff());
}

TEST(Amplitudes, CompleteWhatIsMissing) {
  Bench bench(smallSensor());
  const std::vector<int> missing = missingOf(smallSensor()), present = bench.presentOf(missing);
  const VectorXd picture = bench.picture({{4, 3, kPress}}, 2);
  Eigen::VectorXf there = picture.cast<float>();
  for (const int i : missing) there[i] = 0.0F;
  const double force_N = 0.02;
  const auto strong = std::make_shared<const StrongModes>(bench.factors(), bench.atoms(), everyMode().noise_px);
  Amplitudes amplitudes(bench.factors(), strong);
  const int rank = bench.factors().rank();
  amplitudes.begin({there.data(), static_cast<std::size_t>(there.size())}, missing);
  amplitudes.read(rank);
  for (int i = 0; i < 20; ++i) amplitudes.complete(force_N, kNoise_px);

  // The prior mean of the missing displacements given those that are there.
  const MatrixXd H = bench.atomInfluence();
  const MatrixXd signal = force_N * force_N * H * H.transpose() + bench.strays() * bench.strays().transpose();
  const MatrixXd total = signal + kNoise_px * kNoise_px * MatrixXd::Identity(H.rows(), H.rows());
  VectorXd whole = picture;
  whole(missing) = signal(missing, present) * total(present, present).llt().solve(picture(present));
  Amplitudes expected(bench.factors(), strong);
  const Eigen::VectorXf completed = whole.cast<float>();
  expected.begin({completed.data(), static_cast<std::size_t>(completed.size())}, {});
  expected.read(rank);
  ASSERT_EQ(std::ssize(amplitudes.values()), rank);
  EXPECT_LT((VectorXd::Map(amplitudes.values().data(), rank) - VectorXd::Map(expected.values().data(), rank)).norm(),
            0.1 * kNoise_px);
  EXPECT_GT(VectorXd::Map(expected.values().data(), rank).norm(), 10.0 * kNoise_px);
}

}  // namespace
}  // namespace tractiond::solve
