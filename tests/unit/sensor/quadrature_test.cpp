#include "sensor/elastic/quadrature.h"

#include <gtest/gtest.h>

#include <cmath>

namespace sensor::elastic {
namespace {

// Integral of x^power over [-1, 1].
double monomial(int power) {
  return power % 2 == 0 ? 2.0 / (power + 1) : 0.0;
}

TEST(Quadrature, IntegratesPolynomialsUpToItsDegree) {
  for (int count = 2; count <= 14; ++count) {
    const Rule inner = gauss(count), closed = gaussLobatto(count);
    for (int power = 0; power < 2 * count; ++power)
      EXPECT_NEAR(inner.weights.dot(inner.points.array().pow(power).matrix()), monomial(power), 1e-14);
    for (int power = 0; power < 2 * count - 2; ++power)
      EXPECT_NEAR(closed.weights.dot(closed.points.array().pow(power).matrix()), monomial(power), 1e-14);
    EXPECT_EQ(closed.points[0], -1.0);
    EXPECT_EQ(closed.points[count - 1], 1.0);
  }
}

TEST(Lagrange, ReproducesPolynomialsAndTheirSlopes) {
  const Eigen::VectorXd nodes = gaussLobatto(9).points;
  const Eigen::VectorXd at = Eigen::VectorXd::LinSpaced(11, -1.0, 1.0);
  const Eigen::VectorXd exact = at.array().pow(8) - 2.0 * at.array().pow(3);
  const Eigen::VectorXd slope = 8.0 * at.array().pow(7) - 6.0 * at.array().square();
  const Eigen::VectorXd values = nodes.array().pow(8) - 2.0 * nodes.array().pow(3);
  EXPECT_LT((lagrange(nodes, at) * values - exact).norm(), 1e-13);
  EXPECT_LT((lagrangeDerivative(nodes, at) * values - slope).norm(), 1e-11);
  EXPECT_EQ(lagrange(nodes, nodes), Eigen::MatrixXd::Identity(9, 9));
}

}  // namespace
}  // namespace sensor::elastic
