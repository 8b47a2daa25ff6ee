#include "sensor/elastic/frontal_solver.h"

#include <Eigen/Core>
#include <gtest/gtest.h>

namespace sensor::elastic {
namespace {

using Eigen::MatrixXd;

MatrixXd spd(Eigen::Index n) {
  const MatrixXd a = MatrixXd::Random(n, n);
  return a * a.transpose() + MatrixXd::Identity(n, n);
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
