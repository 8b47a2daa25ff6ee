#include "sensor/elastic/quadrature.h"

#include <cassert>
#include <cmath>
#include <numbers>
#include <utility>

namespace sensor::elastic {
namespace {

// Returns the Legendre polynomials of degree n - 1 and n at x, by recurrence.
std::pair<double, double> legendre(int n, double x) {
  double before = 1.0, value = x;
  for (int k = 2; k <= n; ++k) before = std::exchange(value, ((2 * k - 1) * x * value - (k - 1) * before) / k);
  return {before, value};
}

constexpr int kNewtonSteps = 50;  // a few suffice: convergence from the Chebyshev guess is quadratic

}  // namespace

Rule gauss(int count) {
  assert(count >= 1);
  Rule rule{Eigen::VectorXd(count), Eigen::VectorXd(count)};
  for (int i = 0; i < count; ++i) {
    double x = -std::cos(std::numbers::pi * (i + 0.75) / (count + 0.5));
    double slope = 1.0;
    for (int step = 0; step < kNewtonSteps; ++step) {
      const auto [before, value] = legendre(count, x);
      slope = count * (before - x * value) / (1.0 - x * x);
      const double change = value / slope;
      x -= change;
      if (std::abs(change) < 1e-15) break;
    }
    rule.points[i] = x;
    rule.weights[i] = 2.0 / ((1.0 - x * x) * slope * slope);
  }
  return rule;
}

Rule gaussLobatto(int count) {
  assert(count >= 2);
  const int n = count - 1;
  Rule rule{Eigen::VectorXd(count), Eigen::VectorXd(count)};
  for (int i = 0; i < count; ++i) {
    double x = -std::cos(std::numbers::pi * i / n);
    // The inner points are the zeros of P'_n, found with (1 - x^2) P'_n / n = P_{n-1} - x P_n.
    for (int step = 0; step < kNewtonSteps && i > 0 && i < n; ++step) {
      const auto [before, value] = legendre(n, x);
      const double change = (x * value - before) / ((n + 1) * value);
      x -= change;
      if (std::abs(change) < 1e-15) break;
    }
    const double value = legendre(n, x).second;
    rule.points[i] = x;
    rule.weights[i] = 2.0 / (n * (n + 1) * value * value);
  }
  return rule;
}

Eigen::MatrixXd lagrange(const Eigen::VectorXd& nodes, const Eigen::VectorXd& at) {
  Eigen::MatrixXd values = Eigen::MatrixXd::Ones(at.size(), nodes.size());
  for (int p = 0; p < at.size(); ++p)
    for (int i = 0; i < nodes.size(); ++i)
      for (int k = 0; k < nodes.size(); ++k)
        if (k != i) values(p, i) *= (at[p] - nodes[k]) / (nodes[i] - nodes[k]);
  return values;
}

Eigen::MatrixXd lagrangeDerivative(const Eigen::VectorXd& nodes, const Eigen::VectorXd& at) {
  Eigen::MatrixXd slopes = Eigen::MatrixXd::Zero(at.size(), nodes.size());
  for (int p = 0; p < at.size(); ++p)
    for (int i = 0; i < nodes.size(); ++i)
      for (int left = 0; left < nodes.size(); ++left) {
        if (left == i) continue;
        double product = 1.0 / (nodes[i] - nodes[left]);
        for (int k = 0; k < nodes.size(); ++k)
          if (k != i && k != left) product *= (at[p] - nodes[k]) / (nodes[i] - nodes[k]);
        slopes(p, i) += product;
      }
  return slopes;
}

}  // namespace sensor::elastic
