#include "tests/support/seed.h"
#include "touch/assignment.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

namespace touch {
namespace {

double sum(const Eigen::MatrixXd& cost, const std::vector<int>& columns) {
  double total = 0.0;
  for (int row = 0; row < cost.rows(); ++row) total += cost(row, columns[row]);
  return total;
}

TEST(Assignment, IsTheBestOfAllOfThem) {
  std::mt19937 random(tractiond::test::seed());
  for (int run = 0; run < 500; ++run) {
    const int rows = static_cast<int>(random() % 5);
    const int columns = rows + static_cast<int>(random() % 3);
    Eigen::MatrixXd cost(rows, columns);
    for (double& one : cost.reshaped())
      one = run % 2 ? static_cast<double>(random() % 4) : std::normal_distribution()(random);
    std::vector<int> order(columns);
    std::iota(order.begin(), order.end(), 0);
    double least = sum(cost, order);
    while (std::next_permutation(order.begin(), order.end())) least = std::min(least, sum(cost, order));

    std::vector<int> found = assign(cost);
    ASSERT_EQ(static_cast<int>(found.size()), rows);
    EXPECT_NEAR(sum(cost, found), least, 1e-12);
    std::sort(found.begin(), found.end());
    EXPECT_TRUE(std::adjacent_find(found.begin(), found.end()) == found.end());
  }
}

}  // namespace
}  // namespace touch
