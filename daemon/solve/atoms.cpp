#include "daemon/solve/atoms.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace tractiond::solve {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Half widths of the hats, and their distances [pitches].
constexpr std::array kScales = {2, 4, 8};

/// The least distance of the ring from the gel's sides [pitches]: close to them the mechanics lose precision.
constexpr double kMargin = 0.5;

/// Hats side by side along one axis.
struct Hats {
  VectorXd centres;  ///< from the grid's centre [pitches]
  MatrixXd heights;  ///< points x hats; the sum of a column is 1
};

/// Of `nodes` points and `ring` more at either end, on which hats are 0: a broad contact is expected on the nodes
/// alone.
Hats hatsAlong(int nodes, int ring, int scale) {
  const double furthest = 0.5 * (nodes - 1) + ring;
  const int beside = static_cast<int>(furthest / scale);
  Hats hats{VectorXd::LinSpaced(2 * beside + 1, -beside * scale, beside * scale),
            MatrixXd::Zero(nodes + 2 * ring, 2 * beside + 1)};
  for (Index hat = 0; hat < hats.centres.size(); ++hat) {
    for (int node = 0; node < nodes; ++node) {
      const double distance = std::abs(node - 0.5 * (nodes - 1) - hats.centres[hat]);
      hats.heights(ring + node, hat) = std::max(1.0 - distance / scale, 0.0);
    }
    hats.heights.col(hat) /= hats.heights.col(hat).sum();
  }
  return hats;
}

/// Atoms of one level: their shapes, points x atoms.
struct LevelShapes {
  MatrixXd shape;
  sensor::Points places;
  double spacing_m;
};

LevelShapes hats(const sensor::NodeGrid& nodes, int ring, int scale) {
  const Hats across = hatsAlong(nodes.columns, ring, scale), along = hatsAlong(nodes.rows, ring, scale);
  const Index columns = across.heights.rows(), rows = along.heights.rows();
  const Index count = across.centres.size() * along.centres.size();
  LevelShapes level{MatrixXd(rows * columns, count), sensor::Points::Zero(3, count), scale * nodes.pitch};
  for (Index hat = 0; hat < count; ++hat) {
    const Index i = hat % across.centres.size(), j = hat / across.centres.size();
    // Row after row, as the points are.
    MatrixXd::Map(level.shape.col(hat).data(), columns, rows) =
        across.heights.col(i) * along.heights.col(j).transpose();
    level.places.col(hat).head<2>() = nodes.centre + nodes.pitch * Eigen::Vector2d(across.centres[i], along.centres[j]);
  }
  return level;
}

LevelShapes plate(const sensor::NodeGrid& nodes, const std::vector<int>& nodeOf) {
  LevelShapes level{MatrixXd::Zero(static_cast<Index>(nodeOf.size()), 1), sensor::Points::Zero(3, 1),
                    std::max(nodes.columns, nodes.rows) * nodes.pitch};
  for (std::size_t p = 0; p < nodeOf.size(); ++p) {
    if (nodeOf[p] >= 0) level.shape(static_cast<Index>(p), 0) = 1.0 / nodes.count();
  }
  level.places.col(0).head<2>() = nodes.centre;
  return level;
}

/// Fills shape, places and levels.
void join(const std::vector<LevelShapes>& levels, Atoms& atoms) {
  Index count = 0;
  for (const LevelShapes& level : levels) count += level.places.cols();
  MatrixXd shape(atoms.points.cols(), count);
  atoms.places.resize(3, count);
  Index first = 0;
  for (const LevelShapes& level : levels) {
    const Index end = first + level.places.cols();
    shape.middleCols(first, end - first) = level.shape;
    atoms.places.middleCols(first, end - first) = level.places;
    atoms.levels.push_back({static_cast<int>(first), static_cast<int>(end), level.spacing_m});
    first = end;
  }
  atoms.shape = shape.sparseView();
}

/// Whether the points around the nodes lie well inside the gel.
bool hasRing(const sensor::Sensor& sensor) {
  const sensor::NodeGrid& nodes = sensor.nodes;
  const Eigen::Vector2d half =
      nodes.pitch * (Eigen::Vector2d(nodes.columns + 1, nodes.rows + 1) / 2.0 + Eigen::Vector2d::Constant(kMargin));
  return ((nodes.centre.cwiseAbs() + half).array() <= sensor.gel.size.head<2>().array() / 2.0).all();
}

/// Median distance of a node from the nearest marker.
double markerDistance(const sensor::Body& body) {
  std::vector<double> distances;
  for (const auto& node : body.nodes.colwise()) {
    distances.push_back((body.markers.colwise() - node).colwise().norm().minCoeff());
  }
  const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  return *middle;
}

}  // namespace

Atoms makeAtoms(const sensor::Sensor& sensor) {
  const sensor::NodeGrid& nodes = sensor.nodes;
  Atoms atoms;
  if (sensor.body) {
    atoms.points = sensor.body->nodes;
    for (int n = 0; n < nodes.count(); ++n) atoms.nodes.push_back(n);
    atoms.depth_m = markerDistance(*sensor.body);
    join({{MatrixXd::Identity(nodes.count(), nodes.count()), atoms.points, nodes.pitch}}, atoms);
    return atoms;
  }
  const int ring = hasRing(sensor) ? 1 : 0;
  sensor::NodeGrid grid = nodes;
  grid.columns += 2 * ring;
  grid.rows += 2 * ring;
  atoms.points = sensor::nodePositions(grid);
  for (int row = -ring; row < nodes.rows + ring; ++row) {
    for (int column = -ring; column < nodes.columns + ring; ++column) {
      const bool isNode = row >= 0 && row < nodes.rows && column >= 0 && column < nodes.columns;
      atoms.nodes.push_back(isNode ? row * nodes.columns + column : -1);
    }
  }
  atoms.depth_m = sensor.layers.front().depth;
  for (const sensor::MarkerLayer& layer : sensor.layers) atoms.depth_m = std::min(atoms.depth_m, layer.depth);
  std::vector<LevelShapes> levels = {{MatrixXd::Identity(grid.count(), grid.count()), atoms.points, nodes.pitch}};
  for (const int scale : kScales) levels.push_back(hats(nodes, ring, scale));
  levels.push_back(plate(nodes, atoms.nodes));
  join(levels, atoms);
  return atoms;
}

void addUp(const Atoms& atoms, std::span<const double> forces, std::span<double> pointForces) {
  std::fill(pointForces.begin(), pointForces.end(), 0.0);
  for (int a = 0; a < atoms.count(); ++a) {
    const auto force = Eigen::Vector3d::Map(forces.data() + 3 * static_cast<Index>(a));
    if (force.isZero(0.0)) continue;
    for (Eigen::SparseMatrix<double>::InnerIterator it(atoms.shape, a); it; ++it) {
      Eigen::Vector3d::Map(pointForces.data() + 3 * it.row()) += it.value() * force;
    }
  }
}

}  // namespace tractiond::solve
