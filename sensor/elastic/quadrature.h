// One-dimensional quadrature rules, and Lagrange polynomials through their points. All functions are reentrant.
#pragma once

#include <Eigen/Core>

namespace sensor::elastic {

/// Points in ascending order, and as many weights: the integral is about the sum of weights[i] f(points[i]).
struct Rule {
  Eigen::VectorXd points;
  Eigen::VectorXd weights;
};

/// Returns the Gauss-Legendre rule on [-1, 1], exact to degree 2 count - 1. count >= 1.
Rule gauss(int count);

/// Returns the Gauss-Lobatto-Legendre rule on [-1, 1], which includes both ends, exact to degree 2 count - 3. count >=
/// 2.
Rule gaussLobatto(int count);

/// Returns the values at `at` of the Lagrange polynomials through `nodes`, which must differ: at.size() x nodes.size().
/// They are exactly 0 or 1 at the nodes.
Eigen::MatrixXd lagrange(const Eigen::VectorXd& nodes, const Eigen::VectorXd& at);

/// Returns the derivatives of these polynomials at `at`, in the same shape.
Eigen::MatrixXd lagrangeDerivative(const Eigen::VectorXd& nodes, const Eigen::VectorXd& at);

}  // namespace sensor::elastic
