// In a box, the integral of a product of derivatives of tensor-product polynomials is a product of three integrals
// along the axes. The element's matrix is therefore filled from a few small tables, without quadrature in space.
//
// The element has three mirror planes. In place of the polynomials through a node and its mirror images stand their
// even and odd combinations: the matrix then falls apart into eight, of an eighth of the size, which are condensed one
// by one.
#include "sensor/elastic/spectral_element.h"

#include "sensor/elastic/linear_algebra.h"
#include "sensor/elastic/parallel.h"
#include "sensor/elastic/quadrature.h"

#include <cassert>
#include <map>
#include <numbers>

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

// Replaces the two values of each pair by their sum and their difference, over the root of two; this undoes itself.
template <typename Values>
void combine(Values&& values, const std::vector<std::array<Eigen::Index, 2>>& pairs) {
  for (const auto [a, b] : pairs) {
    const double sum = values[a] + values[b], difference = values[a] - values[b];
    values[a] = sum / std::numbers::sqrt2;
    values[b] = difference / std::numbers::sqrt2;
  }
}

// Replaces the columns, each of a node along an axis, by their even combinations, then, behind the middle, odd ones.
Eigen::MatrixXd combined(Eigen::MatrixXd columns) {
  std::vector<std::array<Eigen::Index, 2>> pairs;
  for (Eigen::Index i = 0; 2 * i < columns.cols() - 1; ++i) pairs.push_back({i, columns.cols() - 1 - i});
  for (auto row : columns.rowwise()) combine(row, pairs);
  return columns;
}

// The rows of the shell's unknowns that combine() takes from the nodes to their combinations, or back.
std::vector<std::array<Eigen::Index, 2>> mirrorPairs(const std::vector<Lattice>& shell, int degree) {
  std::vector<std::array<Eigen::Index, 2>> pairs;
  std::map<Lattice, Eigen::Index> numbers;
  for (const Lattice& node : shell) numbers.emplace(node, std::ssize(numbers));
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (const auto& [node, number] : numbers) {
      if (2 * node[axis] >= degree) continue;
      Lattice image = node;
      image[axis] = degree - node[axis];
      for (int c = 0; c < 3; ++c) pairs.push_back({3 * number + c, 3 * numbers.at(image) + c});
    }
  return pairs;
}

// A component of the displacement by one combination of nodes.
struct Unknown {
  Lattice node;
  int component;
  Eigen::Index number;  // 3 times the number of the node, and the component
};

// Sorts the unknowns of nodes by the class of their combinations: unknowns of two classes have nothing in common.
std::array<std::vector<Unknown>, 8> classesOf(const std::vector<Lattice>& nodes, int degree) {
  std::array<std::vector<Unknown>, 8> classes;
  Eigen::Index number = 0;
  for (const Lattice& node : nodes)
    for (int c = 0; c < 3; ++c) {
      unsigned parity = 1U << c;
      for (unsigned d = 0; d < 3; ++d) parity ^= (2 * node[d] > degree ? 1U : 0U) << d;
      classes[parity].push_back({node, c, number++});
    }
  return classes;
}

// [a][b]: integrals along one edge of the a-th derivative of the row's polynomial times the b-th of the column's.
using Integrals = std::array<std::array<Eigen::MatrixXd, 2>, 2>;

Integrals integrals(int degree, double length, int points) {
  const Rule rule = gauss(points);
  const Eigen::VectorXd nodes = gaussLobatto(degree + 1).points;
  const std::array<Eigen::MatrixXd, 2> values = {combined(lagrange(nodes, rule.points)),
                                                 combined(lagrangeDerivative(nodes, rule.points) * (2.0 / length))};
  const Eigen::VectorXd weights = rule.weights * (0.5 * length);
  Integrals result;
  for (int a = 0; a < 2; ++a)
    for (int b = 0; b < 2; ++b) result[a][b] = values[a].transpose() * weights.asDiagonal() * values[b];
  return result;
}

// Integral over the element of d_a of the row node's polynomial times d_b of the column node's.
double gradients(const std::array<Integrals, 3>& along, const Lattice& row, int a, const Lattice& column, int b) {
  double product = 1.0;
  for (int d = 0; d < 3; ++d) product *= along[d][a == d][b == d](row[d], column[d]);
  return product;
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
  const auto entry = [&](const Unknown& row, const Unknown& column) {
    const int a = row.component, b = column.component;
    double strain = gradients(full, row.node, b, column.node, a);
    for (int d = 0; d < 3 && a == b; ++d) strain += gradients(full, row.node, d, column.node, d);
    return shear * strain + lame * gradients(reduced, row.node, a, column.node, b);
  };
  const auto fill = [&](Eigen::MatrixXd& matrix, const std::vector<Unknown>& rows,
                        const std::vector<Unknown>& columns) {
    matrix.resize(std::ssize(rows), std::ssize(columns));
    for (std::size_t j = 0; j < columns.size(); ++j)
      for (std::size_t i = 0; i < rows.size(); ++i)
        matrix(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = entry(rows[i], columns[j]);
  };

  const std::vector<Lattice> shell = shellNodes(degree);
  const auto outer = classesOf(shell, degree), inner = classesOf(nodes(degree, true), degree);
  const auto size3 = 3 * std::ssize(shell);
  CondensedElement element{degree, Eigen::MatrixXd::Zero(size3, size3), {}, {}};
  inParallel(std::ssize(outer), [&](Eigen::Index parity) {
    Eigen::MatrixXd &factor = element.factor[parity], &coupling = element.coupling[parity], stiffness;
    fill(factor, inner[parity], inner[parity]);
    fill(coupling, inner[parity], outer[parity]);
    fill(stiffness, outer[parity], outer[parity]);
    [[maybe_unused]] const bool isDefinite = factorise(factor);
    assert(isDefinite);
    solveLower(factor, Op::kPlain, coupling);
    multiplyBySelf(-1.0, coupling, Op::kTransposed, 1.0, stiffness);
    for (Eigen::Index j = 0; j < stiffness.cols(); ++j)
      for (Eigen::Index i = 0; i < stiffness.rows(); ++i)
        element.stiffness(outer[parity][i].number, outer[parity][j].number) = stiffness(std::max(i, j), std::min(i, j));
  });
  const auto pairs = mirrorPairs(shell, degree);
  for (int side = 0; side < 2; ++side) {
    for (auto column : element.stiffness.colwise()) combine(column, pairs);
    element.stiffness.transposeInPlace();
  }
  return element;
}

Eigen::MatrixXd CondensedElement::interpolation(const Points& unit) const {
  const Eigen::Index points = unit.cols();
  const Eigen::VectorXd lobatto = gaussLobatto(degree + 1).points;
  std::array<Eigen::MatrixXd, 3> along;
  for (int d = 0; d < 3; ++d)
    along[d] = combined(lagrange(lobatto, (2.0 * unit.row(d).array() - 1.0).matrix().transpose()));
  const auto fill = [&](Eigen::MatrixXd& matrix, const std::vector<Unknown>& rows) {
    matrix.setZero(std::ssize(rows), 3 * points);
    for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
      const auto& [node, c, number] = rows[i];
      matrix.row(i).segment(c * points, points) =
          along[0].col(node[0]).cwiseProduct(along[1].col(node[1])).cwiseProduct(along[2].col(node[2])).transpose();
    }
  };
  const std::vector<Lattice> shell = shellNodes(degree);
  const auto outer = classesOf(shell, degree), inner = classesOf(nodes(degree, true), degree);
  Eigen::MatrixXd result(3 * std::ssize(shell), 3 * points);
  inParallel(std::ssize(outer), [&](Eigen::Index parity) {
    Eigen::MatrixXd inside, values;
    fill(inside, inner[parity]);
    fill(values, outer[parity]);
    solveLower(factor[parity], Op::kPlain, inside);
    multiply(-1.0, coupling[parity], Op::kTransposed, inside, Op::kPlain, 1.0, values);
    for (Eigen::Index i = 0; i < values.rows(); ++i) result.row(outer[parity][i].number) = values.row(i);
  });
  const auto pairs = mirrorPairs(shell, degree);
  for (auto column : result.colwise()) combine(column, pairs);
  return result;
}

}  // namespace sensor::elastic
