#include "sensor/elastic/frontal_solver.h"
#include "sensor/elastic/linear_algebra.h"

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include <algorithm>

namespace sensor::elastic {
namespace {

using Eigen::MatrixXd;

MatrixXd spd(Eigen::Index n) {
  const MatrixXd a = MatrixXd::Random(n, n);
  return a * a.transpose() + MatrixXd::Identity(n, n);
}

TEST(LinearAlgebra, ProductsAgreeWithEigen) {
  const MatrixXd a = MatrixXd::Random(7, 5), b = MatrixXd::Random(5, 6), whole = MatrixXd::Random(9, 9);
  MatrixXd c = whole;
  multiply(2.0, a, Op::kPlain, b, Op::kPlain, 0.5, c.block(1, 2, 7, 6));
  EXPECT_LT((c.block(1, 2, 7, 6) - (2.0 * a * b + 0.5 * whole.block(1, 2, 7, 6))).norm(), 1e-13);
  c.block(1, 2, 7, 6) = whole.block(1, 2, 7, 6);
  EXPECT_EQ(c, whole);
  const MatrixXd at = a.transpose(), bt = b.transpose();
  multiply(1.0, at, Op::kTransposed, bt, Op::kTransposed, 0.0, c.topLeftCorner(7, 6));
  EXPECT_LT((c.topLeftCorner(7, 6) - a * b).norm(), 1e-13);

  MatrixXd square = MatrixXd::Zero(7, 7);
  multiplyBySelf(-1.0, a, Op::kPlain, 1.0, square);
  EXPECT_LT((square - MatrixXd((-a * a.transpose()).triangularView<Eigen::Lower>())).norm(), 1e-13);
}

TEST(LinearAlgebra, FactorAndSolvesInvert) {
  const MatrixXd a = spd(20), b = MatrixXd::Random(20, 3);
  MatrixXd lower = a;
  ASSERT_TRUE(factorise(lower));
  MatrixXd x = b;
  solveLower(lower, Op::kPlain, x);
  solveLower(lower, Op::kTransposed, x);
  EXPECT_LT((a * x - b).norm(), 1e-11);
  MatrixXd y = b.transpose();
  solveLowerRight(lower, Op::kTransposed, y);
  solveLowerRight(lower, Op::kPlain, y);
  EXPECT_LT((y * a - b.transpose()).norm(), 1e-11);
}

TEST(LinearAlgebra, IndefiniteMatrixIsReported) {
  MatrixXd a = -MatrixXd::Identity(3, 3);
  EXPECT_FALSE(factorise(a));
}

TEST(LinearAlgebra, PivotedFactorHasTheRank) {
  const MatrixXd columns = MatrixXd::Random(9, 4), a = columns * columns.transpose();
  MatrixXd factor = a;
  Eigen::VectorXi pivots;
  const Eigen::Index rank = factorisePivoted(1e-12, factor, pivots);
  ASSERT_EQ(rank, 4);
  const MatrixXd lower = factor.leftCols(rank).triangularView<Eigen::Lower>();
  EXPECT_LT((lower * lower.transpose() - a(pivots, pivots)).norm(), 1e-12);
}

TEST(LinearAlgebra, EigenvectorsDiagonalise) {
  const MatrixXd a = spd(12);
  MatrixXd vectors = a;
  vectors.triangularView<Eigen::StrictlyUpper>().setConstant(1e9);  // must not be read
  Eigen::VectorXd values;
  ASSERT_TRUE(eigenvectorsAbove(0.0, vectors, values));
  ASSERT_EQ(values.size(), 12);
  EXPECT_LT((a * vectors - vectors * values.asDiagonal()).norm(), 1e-11);
  EXPECT_LT((vectors.transpose() * vectors - MatrixXd::Identity(12, 12)).norm(), 1e-12);
  EXPECT_TRUE(std::is_sorted(values.begin(), values.end()));

  MatrixXd strongest = a;
  Eigen::VectorXd above;
  ASSERT_TRUE(eigenvectorsAbove(0.5 * (values[8] + values[9]), strongest, above));
  ASSERT_EQ(above.size(), 3);
  EXPECT_LT((above - values.tail(3)).norm(), 1e-12 * values[11]);
  EXPECT_LT((a * strongest - strongest * above.asDiagonal()).norm(), 1e-11);
  ASSERT_TRUE(eigenvectorsAbove(2.0 * values[11], strongest = a, above));
  EXPECT_EQ(strongest.cols(), 0);
}

// Four subdomains in a row of 3 n + 1 unknowns each share their end unknowns.
TEST(FrontalSolver, AgreesWithTheAssembledMatrix) {
  constexpr int kParts = 4, kStep = 6, kUnknowns = kParts * kStep + 1, kColumns = 2;
  MatrixXd matrix = MatrixXd::Zero(kUnknowns, kUnknowns), right = MatrixXd::Zero(kUnknowns, kParts * kColumns);
  FrontalSolver solver(kUnknowns);
  const auto leaf = [&](int part) {
    Front front{{}, spd(kStep + 1), MatrixXd::Random(kStep + 1, kColumns), part * kColumns};
    for (int i = kStep; i >= 0; --i) front.unknowns.push_back(part * kStep + i);  // any order
    for (int i = 0; i <= kStep; ++i) {
      right.row(front.unknowns[i]).segment(part * kColumns, kColumns) += front.right.row(i);
      for (int j = 0; j <= kStep; ++j) matrix(front.unknowns[i], front.unknowns[j]) += front.matrix(i, j);
    }
    front.matrix.triangularView<Eigen::StrictlyUpper>().setConstant(1e9);  // must not be read
    return solver.eliminate({front}, [&](int u) {
      return (u > part * kStep || part == 0) && (u < (part + 1) * kStep || part == kParts - 1);
    });
  };
  const Front first = leaf(0), second = leaf(1);
  const Front half = solver.eliminate({first, second}, [](int u) { return u < 2 * kStep; });
  const Front third = leaf(2), fourth = leaf(3);
  const Front otherHalf = solver.eliminate({third, fourth}, [](int u) { return u > 2 * kStep; });
  solver.eliminate({half, otherHalf}, [](int) { return true; });
  const MatrixXd x = solver.solve(kParts * kColumns);
  EXPECT_LT((matrix * x - right).norm(), 1e-10);
}

}  // namespace
}  // namespace sensor::elastic
