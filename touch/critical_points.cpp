// Strength: the nodes are taken by increasing shear, in deviations. Those that are neighbours grow together to basins,
// in which points of opposite index cancel; so in a basin all that are left have one index. A basin that reaches the
// border of what is touched loses them: there they could leave.
#include "touch/critical_points.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <tuple>
#include <utility>

namespace touch {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Triangle = std::array<int, 3>;  ///< nodes, from x towards y

/// Distance at which a node counts e^-0.5 in the fit of a place, and up to which it counts [pitches].
constexpr double kNear = 1.0;
constexpr int kFar = 3;

double cross(const Vector2d& a, const Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

/// The grid, of which only what is touched counts.
class Grid {
 public:
  explicit Grid(const NodeForces& nodes)
      : nodes_(nodes) {
    const int count = nodes.columns * nodes.rows;
    for (int node = 0; node < count; ++node)
      strength_.push_back(deviation(node) > 0.0 ? shear(node).norm() / deviation(node) : -1.0);
    for (int row = 0; row + 1 < nodes.rows; ++row) {
      for (int column = 0; column + 1 < nodes.columns; ++column) {
        const int a = row * nodes.columns + column, b = a + 1, c = b + nodes.columns, d = a + nodes.columns;
        const bool isEven = (row + column) % 2 == 0;
        add(isEven ? Triangle{a, b, c} : Triangle{a, b, d});
        add(isEven ? Triangle{a, c, d} : Triangle{b, c, d});
      }
    }
  }

  const std::vector<Triangle>& triangles() const { return triangles_; }
  /// Shear of a node in its deviations; negative: nothing touches it.
  const std::vector<double>& strength() const { return strength_; }
  Vector2d shear(int node) const { return {at(nodes_.force_N, node)[0], at(nodes_.force_N, node)[1]}; }
  double pressure(int node) const { return at(nodes_.force_N, node)[2]; }
  double deviation(int node) const {
    return std::max(at(nodes_.deviation_N, node)[0], at(nodes_.deviation_N, node)[1]);
  }
  Vector2d place(int node) const {
    const int column = node % nodes_.columns, row = node / nodes_.columns;
    const Vector2d steps(column - 0.5 * (nodes_.columns - 1), row - 0.5 * (nodes_.rows - 1));
    return Vector2d(nodes_.centre_m[0], nodes_.centre_m[1]) + nodes_.pitch_m * steps;
  }
  double pitch_m() const { return nodes_.pitch_m; }

  /// Calls with each touched node that is at most kFar pitches away from a node along each axis.
  void forEachNear(int node, const auto& call) const {
    const int row = node / nodes_.columns, column = node % nodes_.columns;
    for (int y = std::max(row - kFar, 0); y <= std::min(row + kFar, nodes_.rows - 1); ++y) {
      for (int x = std::max(column - kFar, 0); x <= std::min(column + kFar, nodes_.columns - 1); ++x) {
        const int near = y * nodes_.columns + x;
        if (strength_[static_cast<std::size_t>(near)] >= 0.0) call(near);
      }
    }
  }

 private:
  static const std::array<float, 3>& at(std::span<const std::array<float, 3>> numbers, int node) {
    return numbers[static_cast<std::size_t>(node)];
  }
  void add(const Triangle& triangle) {
    const auto isTouched = [&](int node) { return strength_[static_cast<std::size_t>(node)] >= 0.0; };
    if (std::ranges::all_of(triangle, isTouched)) triangles_.push_back(triangle);
  }

  const NodeForces& nodes_;
  std::vector<double> strength_;
  std::vector<Triangle> triangles_;
};

/// Returns how often the shear winds about 0 on the way around a triangle: crossings of the positive x axis. Of a zero
/// on an edge or a node, one triangle alone has it.
int winding(const Grid& grid, const Triangle& triangle) {
  int count = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vector2d from = grid.shear(triangle[i]), to = grid.shear(triangle[(i + 1) % 3]);
    if (from.y() <= 0.0 && to.y() > 0.0 && cross(from, to) > 0.0) ++count;
    if (from.y() > 0.0 && to.y() <= 0.0 && cross(from, to) < 0.0) --count;
  }
  return count;
}

/// The shear, or shear over pressure, around a point: J (x - zero).
struct Linear {
  Vector2d zero;
  Matrix2d J;
  double deviation;  ///< of its two components
};

/// Returns that of a triangle with a zero in it.
Linear inTriangle(const Grid& grid, const Triangle& triangle) {
  const auto [a, b, c] = triangle;
  Matrix2d places, shears;
  places << grid.place(b) - grid.place(a), grid.place(c) - grid.place(a);
  shears << grid.shear(b) - grid.shear(a), grid.shear(c) - grid.shear(a);
  const Vector2d share = -shears.inverse() * grid.shear(a);
  const double deviation =
      (1.0 - share.sum()) * grid.deviation(a) + share[0] * grid.deviation(b) + share[1] * grid.deviation(c);
  return {grid.place(a) + places * share, shears * places.inverse(), deviation};
}

/// Returns shear = pressure * J (x - zero) of the nodes around, by least squares: each node counts by its nearness, and
/// the inverse of its pressure. Where the triangle is not pressed, the pressure counts as 1.
Linear around(const Grid& grid, const Triangle& triangle, const Vector2d& place) {
  const bool isPressed = std::ranges::all_of(triangle, [&](int node) { return grid.pressure(node) > 0.0; });
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, 3, 2> right = Eigen::Matrix<double, 3, 2>::Zero();
  double deviation = 0.0;
  grid.forEachNear(triangle[0], [&](int node) {
    const double pressure = isPressed ? grid.pressure(node) : 1.0;
    if (pressure <= 0.0) return;
    const Vector2d arm = (grid.place(node) - place) / grid.pitch_m();
    const double weight = std::exp(-0.5 * arm.squaredNorm() / (kNear * kNear));
    const Vector3d terms(1.0, arm.x(), arm.y());
    normal += weight * pressure * terms * terms.transpose();
    right += weight * terms * grid.shear(node).transpose();
    deviation += weight * grid.deviation(node);
  });
  const Eigen::Matrix<double, 3, 2> found = normal.ldlt().solve(right);
  const Matrix2d J = found.bottomRows<2>().transpose() / grid.pitch_m();
  return {place - J.inverse() * found.row(0).transpose(), J, deviation / normal(0, 0)};
}

CriticalPoint describe(const Grid& grid, const Triangle& triangle, int index) {
  Linear best = inTriangle(grid, triangle);
  CriticalPoint point;
  point.index = index;
  point.betweenNodes_m = {best.zero.x(), best.zero.y()};
  const Linear fitted = around(grid, triangle, best.zero);
  const double moved_m = (fitted.zero - best.zero).norm();
  if (moved_m <= grid.pitch_m() && fitted.J.determinant() * index > 0.0) best = fitted;
  const Vector2d deviation = best.deviation * best.J.inverse().rowwise().norm();
  point.position_m = {best.zero.x(), best.zero.y()};
  point.positionDeviation_m = {deviation.x(), deviation.y()};
  if (index < 0) {
    point.kind = CriticalPointKind::kSaddle;
    return point;
  }
  const double along = best.J.trace(), across = best.J(1, 0) - best.J(0, 1);
  point.angle_rad = std::atan2(across, along);
  if (std::abs(across) > std::abs(along)) {
    point.kind = CriticalPointKind::kVortex;
  } else {
    point.kind = along > 0.0 ? CriticalPointKind::kSource : CriticalPointKind::kSink;
  }
  return point;
}

/// Nodes, and the points in their triangles, that have grown together.
class Basins {
 public:
  Basins(const Grid& grid, std::vector<CriticalPoint>& points, const std::vector<Triangle>& triangleOf)
      : points_(points)
      , neighbours_(grid.strength().size())
      , triangles_(grid.strength().size())
      , basins_(grid.strength().size() + points.size())
      , taken_(basins_.size(), false)
      , parent_(basins_.size()) {
    std::iota(parent_.begin(), parent_.end(), std::size_t{0});
    for (const Triangle& triangle : grid.triangles()) {
      for (std::size_t i = 0; i < 3; ++i) {
        const auto node = static_cast<std::size_t>(triangle[i]);
        ++triangles_[node];
        for (const std::size_t k : {1U, 2U})
          neighbours_[node].push_back(static_cast<std::size_t>(triangle[(i + k) % 3]));
      }
    }
    for (std::size_t i = 0; i < points.size(); ++i) {
      const std::size_t self = grid.strength().size() + i;
      taken_[self] = true;
      basins_[self].points = {i};
      for (const int node : triangleOf[i]) neighbours_[static_cast<std::size_t>(node)].push_back(self);
    }
  }

  /// Takes the next node.
  /// \param trianglesInside that a node has unless it is at the border
  void take(std::size_t node, double strength, std::size_t trianglesInside) {
    taken_[node] = true;
    std::size_t root = node;
    basins_[root].isOpen = triangles_[node] < trianglesInside;
    for (const std::size_t neighbour : neighbours_[node]) {
      if (taken_[neighbour]) root = join(root, rootOf(neighbour), strength);
    }
    Basin& basin = basins_[root];
    if (!basin.isOpen) return;
    for (const std::size_t point : basin.points) points_[point].strength = strength;
    basin.points.clear();
  }

 private:
  struct Basin {
    std::vector<std::size_t> points;  ///< of one index
    bool isOpen = false;              ///< reaches the border
  };

  std::size_t rootOf(std::size_t member) {
    while (parent_[member] != member) member = parent_[member] = parent_[parent_[member]];
    return member;
  }

  std::size_t join(std::size_t a, std::size_t b, double strength) {
    if (a == b) return a;
    parent_[b] = a;
    Basin& into = basins_[a];
    Basin from = std::move(basins_[b]);
    into.isOpen = into.isOpen || from.isOpen;
    while (!into.points.empty() && !from.points.empty() &&
           points_[into.points.front()].index != points_[from.points.front()].index) {
      cancelNearest(into.points, from.points, strength);
    }
    into.points.insert(into.points.end(), from.points.begin(), from.points.end());
    return a;
  }

  void cancelNearest(std::vector<std::size_t>& some, std::vector<std::size_t>& others, double strength) {
    const auto distance = [&](std::size_t one, std::size_t other) {
      const std::array<double, 2>&from = points_[one].betweenNodes_m, &to = points_[other].betweenNodes_m;
      return std::hypot(to[0] - from[0], to[1] - from[1]);
    };
    auto first = some.begin(), second = others.begin();
    for (auto one = some.begin(); one != some.end(); ++one) {
      for (auto other = others.begin(); other != others.end(); ++other) {
        if (distance(*one, *other) < distance(*first, *second)) std::tie(first, second) = {one, other};
      }
    }
    points_[*first].strength = points_[*second].strength = strength;
    some.erase(first);
    others.erase(second);
  }

  std::vector<CriticalPoint>& points_;
  std::vector<std::vector<std::size_t>> neighbours_;  ///< of each node: nodes, then points
  std::vector<std::size_t> triangles_;                ///< of each node: how many touched ones have it
  std::vector<Basin> basins_;                         ///< of nodes, then points; empty unless it is a root
  std::vector<bool> taken_;
  std::vector<std::size_t> parent_;
};

bool isWhole(const NodeForces& nodes) {
  if (nodes.columns < 2 || nodes.rows < 2 || nodes.pitch_m <= 0.0) return false;
  const auto count = static_cast<std::size_t>(nodes.columns) * static_cast<std::size_t>(nodes.rows);
  return nodes.force_N.size() == count && nodes.deviation_N.size() == count;
}

}  // namespace

std::vector<CriticalPoint> criticalPoints(const NodeForces& nodes, double leastStrength) {
  if (!isWhole(nodes)) return {};
  const Grid grid(nodes);
  std::vector<CriticalPoint> points;
  std::vector<Triangle> triangleOf;
  for (const Triangle& triangle : grid.triangles()) {
    const int index = winding(grid, triangle);
    if (index == 0) continue;
    points.push_back(describe(grid, triangle, index));
    triangleOf.push_back(triangle);
  }
  if (points.empty()) return {};
  Basins basins(grid, points, triangleOf);
  std::vector<std::size_t> order(grid.strength().size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::erase_if(order, [&](std::size_t node) { return grid.strength()[node] < 0.0; });
  std::ranges::sort(order, {}, [&](std::size_t node) { return grid.strength()[node]; });
  for (const std::size_t node : order) {
    const auto columns = static_cast<std::size_t>(nodes.columns);
    basins.take(node, grid.strength()[node], (node / columns + node % columns) % 2 == 0 ? 8 : 4);
  }
  std::erase_if(points, [&](const CriticalPoint& point) { return point.strength < leastStrength; });
  std::ranges::sort(points, std::greater(), &CriticalPoint::strength);
  return points;
}

}  // namespace touch
