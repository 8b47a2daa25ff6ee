#include "daemon/solve/inverse.h"
#include "tests/unit/solve/sensors.h"

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <limits>

namespace tractiond::solve::inverse_test {
namespace {

using Eigen::MatrixXd;

MatrixXd dense(const RowMatrix& matrix) {
  using Rows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  return Eigen::Map<const Rows, 0, Eigen::OuterStride<>>(matrix.row(0), matrix.rows(), matrix.columns(),
                                                         Eigen::OuterStride<>(matrix.stride()))
      .cast<double>();
}

const sensor::Sensor kSensor = smallSensor();
const MatrixXd kInfluence = halfSpaceImage(kSensor, sensor::nodePositions(kSensor.nodes));

/// Falling; those below 1e-7 of the largest are rounding.
Eigen::VectorXd singularValues() {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> gram(kInfluence.transpose() * kInfluence, Eigen::EigenvaluesOnly);
  return gram.eigenvalues().cwiseMax(0.0).cwiseSqrt().reverse();
}

TEST(Inverse, WithoutTruncationIsTikhonovs) {
  SolveOptions options;
  options.truncation = 0.0;
  const Inverse inverse = computeInverse(kInfluence, still(kInfluence.rows()), options).value();
  const double lambda = inverse.lambda;
  EXPECT_NEAR(lambda, 1e-3 * singularValues()[0], 1e-4 * lambda);

  const Eigen::VectorXd s = Eigen::VectorXd::Map(inverse.singularValues.data(), inverse.rank());
  const Eigen::VectorXd filter = s.array() / (s.array().square() + lambda * lambda);
  const MatrixXd factored =
      dense(inverse.right).transpose() * filter.asDiagonal() * dense(inverse.left).leftCols(inverse.rank()).transpose();
  const MatrixXd gram = kInfluence.transpose() * kInfluence;
  const MatrixXd expected =
      (gram + lambda * lambda * MatrixXd::Identity(gram.rows(), gram.cols())).ldlt().solve(kInfluence.transpose());
  EXPECT_LT((factored - expected).norm(), 1e-6 * expected.norm());
}

TEST(Inverse, KeepsTheSingularValuesThatCount) {
  SolveOptions options;
  options.truncation = 0.5;
  const Inverse inverse = computeInverse(kInfluence, still(kInfluence.rows()), options).value();
  const Eigen::VectorXd s = singularValues();
  ASSERT_LT(inverse.rank(), s.size());
  for (int i = 0; i < inverse.rank(); ++i) EXPECT_NEAR(inverse.singularValues[i], s[i], 1e-8 * s[i]);
  EXPECT_GT(inverse.singularValues.back(), 0.5 * inverse.lambda);
  EXPECT_LE(s[inverse.rank()], 0.5 * inverse.lambda);
}

TEST(Inverse, SingularVectorsAreOrthonormal) {
  const Inverse inverse = computeInverse(kInfluence, still(kInfluence.rows()), SolveOptions{}).value();
  const MatrixXd u = dense(inverse.left).leftCols(inverse.rank()), v = dense(inverse.right);
  const MatrixXd one = MatrixXd::Identity(inverse.rank(), inverse.rank());
  EXPECT_LT((u.transpose() * u - one).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LT((v * v.transpose() - one).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(Inverse, HatMatrixMapsDisplacementsToTheirFit) {
  const Inverse inverse = computeInverse(kInfluence, still(kInfluence.rows()), SolveOptions{}).value();
  const Eigen::VectorXd s = Eigen::VectorXd::Map(inverse.singularValues.data(), inverse.rank());
  const double squared = inverse.lambda * inverse.lambda;
  const MatrixXd u = dense(inverse.left).leftCols(inverse.rank());
  const MatrixXd hat = u * (s.array().square() / (s.array().square() + squared)).matrix().asDiagonal() * u.transpose();
  for (const auto& [i, j] : {std::pair{0, 0}, {5, 3}, {3, 5}, {inverse.coordinateCount() - 1, 0}}) {
    EXPECT_NEAR(inverse.hatAt(i, j), hat(i, j), 1e-6);
  }
}

TEST(Inverse, ProgressRisesFromNothingToAll) {
  std::vector<double> fractions;
  ASSERT_TRUE(computeInverse(kInfluence, still(kInfluence.rows()), SolveOptions{},
                             [&](double fraction) { fractions.push_back(fraction); }));
  EXPECT_TRUE(std::is_sorted(fractions.begin(), fractions.end()));
  EXPECT_EQ(fractions.front(), 0.0);
  EXPECT_EQ(fractions.back(), 1.0);
}

TEST(Inverse, RefusesMatricesWithoutOne) {
  EXPECT_FALSE(computeInverse(MatrixXd::Zero(4, 3), still(4), SolveOptions{}));
  MatrixXd poisoned = kInfluence;
  poisoned(3, 2) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(computeInverse(poisoned, still(poisoned.rows()), SolveOptions{}));
}

}  // namespace
}  // namespace tractiond::solve::inverse_test
