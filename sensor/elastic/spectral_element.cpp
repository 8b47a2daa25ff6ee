// In a box, the integral of a product of derivatives of tensor-product polynomials is a product of three integrals
// along the axes. The element's matrix is therefore filled from a few small tables, without quadrature in space.
#include "sensor/elastic/spectral_element.h"

#include "sensor/elastic/linear_algebra.h"
#include "sensor/elastic/parallel.h"
#include "sensor/elastic/quadrature.h"

#include <cassert>

namespace sensor::elastic {
namespace {

bool isInterior(const Lattice& node, int degree) {
  for (const int i : node)
    if (i == 0 || i == degree) return false;
  return true;
}

std::vector<Lattice> nodes(int degree, bool interior) {
  std::vector<Lattice> result;
  for (int k = 0; k <= degree; ++k)
    for (int j = 0; j <= degree; ++j)
      for (int i = 0; i <= degree; ++i)
        if (isInterior({i, j, k}, degree) == interior) result.push_back({i, j, k});
  return result;
}

// [a][b]: integrals along one edge of the a-th derivative of the row's polynomial times the b-th of the column's.
using Integrals = std::array<std::array<Eigen::MatrixXd, 2>, 2>;

Integrals integrals(int degree, double length, int points) {
  const Rule rule = gauss(points);
  const Eigen::VectorXd nodes = gaussLobatto(degree + 1).points;
  const std::array<Eigen::MatrixXd, 2> values = {lagrange(nodes, rule.points),
                                                 lagrangeDerivative(nodes, rule.points) * (2.0 / length)};
  const Eigen::VectorXd weights = rule.weights * (0.5 * length);
  Integrals result;
  for (int a = 0; a < 2; ++a)
    for (int b = 0; b < 2; ++b) result[a][b] = values[a].transpose() * weights.asDiagonal() * values[b];
  return result;
}

// [a][b]: integral over the element of d_a of the row node's polynomial times d_b of the column node's.
using Gradients = std::array<std::array<double, 3>, 3>;

Gradients gradients(const std::array<Integrals, 3>& along, const Lattice& row, const Lattice& column) {
  std::array<std::array<std::array<double, 2>, 2>, 3> t;
  for (int d = 0; d < 3; ++d)
    for (int a = 0; a < 2; ++a)
      for (int b = 0; b < 2; ++b) t[d][a][b] = along[d][a][b](row[d], column[d]);
  Gradients g;
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) g[a][b] = t[0][a == 0][b == 0] * t[1][a == 1][b == 1] * t[2][a == 2][b == 2];
  return g;
}

}  // namespace

std::vector<Lattice> shellNodes(int degree) {
  return nodes(degree, false);
}

CondensedElement condensedElement(int degree, const Eigen::Vector3d& size, double youngsModulus, double poissonRatio) {
  assert(degree >= 2 && poissonRatio < 0.5);
  const double shear = youngsModulus / (2.0 * (1.0 + poissonRatio));
  const double lame = 2.0 * shear * poissonRatio / (1.0 - 2.0 * poissonRatio);
  std::array<Integrals, 3> full, reduced;
  for (int d = 0; d < 3; ++d) {
    full[d] = integrals(degree, size[d], degree + 1);
    reduced[d] = integrals(degree, size[d], degree - 1);
  }
  const auto block = [&](const Lattice& row, const Lattice& column) {
    const Gradients f = gradients(full, row, column), r = gradients(reduced, row, column);
    const double laplacian = f[0][0] + f[1][1] + f[2][2];
    Eigen::Matrix3d k;
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) k(a, b) = shear * ((a == b ? laplacian : 0.0) + f[b][a]) + lame * r[a][b];
    return k;
  };

  const std::vector<Lattice> shell = shellNodes(degree), interior = nodes(degree, true);
  const auto inner = static_cast<Eigen::Index>(interior.size()), outer = static_cast<Eigen::Index>(shell.size());
  // Unknown a * inner + m of the interior is component a at node m.
  CondensedElement element{degree, Eigen::MatrixXd::Zero(3 * outer, 3 * outer), Eigen::MatrixXd(3 * inner, 3 * inner),
                           Eigen::MatrixXd(3 * inner, 3 * outer)};
  inParallel(inner, [&](Eigen::Index column) {
    for (Eigen::Index row = column; row < inner; ++row) {
      const Eigen::Matrix3d k = block(interior[row], interior[column]);
      for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b) {
          element.factor(a * inner + row, b * inner + column) = k(a, b);
          element.factor(b * inner + column, a * inner + row) = k(a, b);
        }
    }
  });
  inParallel(outer, [&](Eigen::Index column) {
    for (Eigen::Index row = 0; row < inner; ++row) {
      const Eigen::Matrix3d k = block(interior[row], shell[column]);
      for (int a = 0; a < 3; ++a) element.coupling.row(a * inner + row).segment<3>(3 * column) = k.row(a);
    }
    for (Eigen::Index row = column; row < outer; ++row)
      element.stiffness.block<3, 3>(3 * row, 3 * column) = block(shell[row], shell[column]);
  });

  [[maybe_unused]] const bool isDefinite = factorise(element.factor);
  assert(isDefinite);
  solveLower(element.factor, Op::kPlain, element.coupling);
  multiplyBySelf(-1.0, element.coupling, Op::kTransposed, 1.0, element.stiffness);
  return element;
}

Eigen::MatrixXd CondensedElement::interpolation(const Points& unit) const {
  const Eigen::Index points = unit.cols();
  const Eigen::VectorXd lobatto = gaussLobatto(degree + 1).points;
  std::array<Eigen::MatrixXd, 3> along;
  for (int d = 0; d < 3; ++d) along[d] = lagrange(lobatto, (2.0 * unit.row(d).array() - 1.0).matrix().transpose());
  const auto values = [&](const Lattice& node) -> Eigen::RowVectorXd {
    return along[0].col(node[0]).cwiseProduct(along[1].col(node[1])).cwiseProduct(along[2].col(node[2])).transpose();
  };
  const std::vector<Lattice> shell = shellNodes(degree), interior = nodes(degree, true);
  const auto inner = static_cast<Eigen::Index>(interior.size());
  Eigen::MatrixXd inside = Eigen::MatrixXd::Zero(3 * inner, 3 * points);
  for (Eigen::Index m = 0; m < inner; ++m)
    for (int c = 0; c < 3; ++c) inside.row(c * inner + m).segment(c * points, points) = values(interior[m]);
  solveLower(factor, Op::kPlain, inside);
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(coupling.cols(), 3 * points);
  for (std::size_t n = 0; n < shell.size(); ++n)
    for (int c = 0; c < 3; ++c)
      result.row(3 * static_cast<Eigen::Index>(n) + c).segment(c * points, points) = values(shell[n]);
  multiply(-1.0, coupling, Op::kTransposed, inside, Op::kPlain, 1.0, result);
  return result;
}

}  // namespace sensor::elastic
