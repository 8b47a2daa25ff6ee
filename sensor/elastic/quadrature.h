// One-dimensional quadrature rules and the Lagrange polynomials through their points.
#pragma once

#include <Eigen/Core>

namespace sensor::elastic {

/// Points in ascending order and weights.
struct Rule {
  Eigen::VectorXd points;
  Eigen::VectorXd weights;
};

/// Gauss-Legendre on [-1, 1], exact to degree 2 count - 1.
Rule gauss(int count);

/// Gauss-Lobatto-Legendre on [-1, 1], both ends included; exact to degree 2 count - 3. count >= 2.
Rule gaussLobatto(int count);

/// Values of the Lagrange polynomials through `nodes` at `at`: at.size() x nodes.size(). Exact at the nodes.
Eigen::MatrixXd lagrange(const Eigen::VectorXd& nodes, const Eigen::VectorXd& at);

/// Their derivatives, same shape.
Eigen::MatrixXd lagrangeDerivative(const Eigen::VectorXd& nodes, const Eigen::VectorXd& at);

}  // namespace sensor::elastic
