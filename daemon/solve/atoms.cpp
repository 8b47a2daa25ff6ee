#include "daemon/solve/atoms.h"

#include "base/quantile.h"
#include "daemon/solve/wrench.h"

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

/// The most rings of points around the nodes, and the least distance of the outermost from the gel's sides [pitches]:
/// close to them the mechanics lose precision.
constexpr int kRings = 2;
constexpr double kMargin = 0.5;

/// The plate's pressure is averaged over this share of its longer side: wider than the holes between chosen atoms, and
/// so narrow that a contact on part of the face gives the plate no roughness, whatever the size of the face.
constexpr double kPlateReach = 1.0 / 8.0;

/// Rounding that a distance in pitches may have.
constexpr double kRounding = 1e-9;

/// Hats side by side along one axis.
struct Hats {
  VectorXd centres;  ///< from the grid's centre [pitches]
  MatrixXd heights;  ///< points x hats; the sum of a column is 1
};

/// Of `nodes` points and `rings` more at either end, on which hats are 0: a broad contact is expected on the nodes
/// alone. The centres reach a pitch beyond the nodes at most, so that every hat covers some.
Hats hatsAlong(int nodes, int rings, int scale) {
  const double furthest = 0.5 * (nodes - 1) + 1.0;
  const int beside = static_cast<int>(furthest / scale);
  Hats hats{VectorXd::LinSpaced(2 * beside + 1, -beside * scale, beside * scale),
            MatrixXd::Zero(nodes + 2 * rings, 2 * beside + 1)};
  for (Index hat = 0; hat < hats.centres.size(); ++hat) {
    for (int node = 0; node < nodes; ++node) {
      const double distance = std::abs(node - 0.5 * (nodes - 1) - hats.centres[hat]);
      hats.heights(rings + node, hat) = std::max(1.0 - distance / scale, 0.0);
    }
    hats.heights.col(hat) /= hats.heights.col(hat).sum();
  }
  return hats;
}

/// Atoms of one level: their shapes, points x atoms.
struct LevelShapes {
  MatrixXd shape;
  sensor::Points places;
  double spacing_m, reach_m;
  bool ambiguous;
};

LevelShapes hats(const sensor::NodeGrid& nodes, int rings, int scale) {
  const Hats across = hatsAlong(nodes.columns, rings, scale), along = hatsAlong(nodes.rows, rings, scale);
  const Index columns = across.heights.rows(), rows = along.heights.rows();
  const Index count = across.centres.size() * along.centres.size();
  LevelShapes level{MatrixXd(rows * columns, count), sensor::Points::Zero(3, count), scale * nodes.pitch, nodes.pitch,
                    scale == kScales.back()};
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
  const double side_m = std::max(nodes.columns, nodes.rows) * nodes.pitch;
  LevelShapes level{MatrixXd::Zero(static_cast<Index>(nodeOf.size()), 1), sensor::Points::Zero(3, 1), side_m,
                    std::max(kPlateReach * side_m, nodes.pitch), true};
  for (std::size_t p = 0; p < nodeOf.size(); ++p) {
    if (nodeOf[p] >= 0) level.shape(static_cast<Index>(p), 0) = 1.0 / nodes.count();
  }
  level.places.col(0).head<2>() = nodes.centre;
  return level;
}

/// Rows of the broadest hats along the four sides.
LevelShapes lines(const sensor::NodeGrid& nodes, int rings) {
  constexpr int kScale = kScales.back();
  const Hats across = hatsAlong(nodes.columns, rings, kScale), along = hatsAlong(nodes.rows, rings, kScale);
  const Index columns = across.heights.rows(), rows = along.heights.rows();
  const Index count = 2 * (rings + 1) * (across.centres.size() + along.centres.size());
  LevelShapes level{MatrixXd::Zero(rows * columns, count), sensor::Points::Zero(3, count), kScale * nodes.pitch,
                    nodes.pitch, true};
  Index line = 0;
  const auto add = [&](const MatrixXd& shape, double x, double y) {
    level.shape.col(line) = shape.reshaped();
    level.places.col(line++).head<2>() = nodes.centre + nodes.pitch * Eigen::Vector2d(x, y);
  };
  for (int side = -1; side <= 1; side += 2) {
    for (int out = 0; out <= rings; ++out) {
      const double y = side * (0.5 * (nodes.rows - 1) + out), x = side * (0.5 * (nodes.columns - 1) + out);
      const Index row = side < 0 ? rings - out : rows - 1 - rings + out;
      const Index column = side < 0 ? rings - out : columns - 1 - rings + out;
      for (Index hat = 0; hat < across.centres.size(); ++hat) {
        add(across.heights.col(hat) * VectorXd::Unit(rows, row).transpose(), across.centres[hat], y);
      }
      for (Index hat = 0; hat < along.centres.size(); ++hat) {
        add(VectorXd::Unit(columns, column) * along.heights.col(hat).transpose(), x, along.centres[hat]);
      }
    }
  }
  return level;
}

/// Fills levels, places, and what follows from the shape of the atoms. To be called last.
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
    atoms.levels.push_back(
        {static_cast<int>(first), static_cast<int>(end), level.spacing_m, level.reach_m, level.ambiguous});
    first = end;
  }
  atoms.shape = shape.sparseView();
  atoms.ofPoints = atoms.shape;
  atoms.ofPoints.conservativeResize(atoms.points.cols() + kCouples, count);
  std::vector<Eigen::Triplet<double>> ofNodes;
  atoms.wrench.setZero(6, 3 * count);
  for (Index a = 0; a < count; ++a) {
    for (Eigen::SparseMatrix<double>::InnerIterator it(atoms.shape, a); it; ++it) {
      ofNodes.emplace_back(atoms.nodeOf(static_cast<int>(it.row())), static_cast<int>(a), it.value());
      atoms.wrench.middleCols<3>(3 * a) += it.value() * unitWrenches(atoms.points.col(it.row()));
    }
  }
  atoms.ofNodes.resize(atoms.nodeCount(), count);
  atoms.ofNodes.setFromTriplets(ofNodes.begin(), ofNodes.end());
}

/// Number of rings around the nodes that lie well inside the gel.
int ringsOf(const sensor::Sensor& sensor) {
  const sensor::NodeGrid& nodes = sensor.nodes;
  const Eigen::Vector2d span = nodes.pitch * Eigen::Vector2d(nodes.columns - 1, nodes.rows - 1) / 2.0;
  const Eigen::Vector2d room = sensor.gel.size.head<2>() / 2.0 - nodes.centre.cwiseAbs() - span;
  return std::clamp(static_cast<int>(std::floor(room.minCoeff() / nodes.pitch - kMargin + kRounding)), 0, kRings);
}

/// Median distance of a node from the nearest marker.
double markerDistance(const sensor::Body& body) {
  std::vector<double> distances;
  for (const auto& node : body.nodes.colwise()) {
    distances.push_back((body.markers.colwise() - node).colwise().norm().minCoeff());
  }
  return quantile(distances);
}

}  // namespace

Atoms makeAtoms(const sensor::Sensor& sensor) {
  const sensor::NodeGrid& nodes = sensor.nodes;
  Atoms atoms;
  atoms.pitch_m = nodes.pitch;
  if (sensor.body) {
    atoms.points = sensor.body->nodes;
    for (int n = 0; n < nodes.count(); ++n) atoms.nodes.push_back(n);
    atoms.nearest = atoms.nodes;
    atoms.depth_m = markerDistance(*sensor.body);
    join({{MatrixXd::Identity(nodes.count(), nodes.count()), atoms.points, nodes.pitch, nodes.pitch, false}}, atoms);
    return atoms;
  }
  const int rings = ringsOf(sensor);
  sensor::NodeGrid grid = nodes;
  grid.columns += 2 * rings;
  grid.rows += 2 * rings;
  atoms.points = sensor::nodePositions(grid);
  atoms.columns = grid.columns;
  atoms.rows = grid.rows;
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const int r = std::clamp(row, rings, rings + nodes.rows - 1);
      const int c = std::clamp(column, rings, rings + nodes.columns - 1);
      const bool isNode = r == row && c == column;
      atoms.nodes.push_back(isNode ? (row - rings) * nodes.columns + column - rings : -1);
      atoms.nearest.push_back(r * grid.columns + c);
    }
  }
  atoms.depth_m = sensor.layers.front().depth;
  for (const sensor::MarkerLayer& layer : sensor.layers) atoms.depth_m = std::min(atoms.depth_m, layer.depth);
  std::vector<LevelShapes> levels = {
      {MatrixXd::Identity(grid.count(), grid.count()), atoms.points, nodes.pitch, nodes.pitch, false}};
  for (const int scale : kScales) levels.push_back(hats(nodes, rings, scale));
  levels.push_back(plate(nodes, atoms.nodes));
  levels.push_back(lines(nodes, rings));
  join(levels, atoms);
  return atoms;
}

bool Atoms::isAmbiguous(int atom) const {
  const auto holds = [atom](const Level& level) { return level.first <= atom && atom < level.end; };
  return std::find_if(levels.begin(), levels.end(), holds)->ambiguous;
}

int Atoms::nodeCount() const {
  return 1 + *std::max_element(nodes.begin(), nodes.end());
}

void addAtNodes(const Atoms& atoms, std::span<const double> pointForces, std::span<double> nodeForces) {
  std::fill(nodeForces.begin(), nodeForces.end(), 0.0);
  for (int p = 0; p < atoms.pointCount(); ++p) {
    Eigen::Vector3d::Map(nodeForces.data() + 3 * std::ptrdiff_t{atoms.nodeOf(p)}) +=
        Eigen::Vector3d::Map(pointForces.data() + 3 * std::ptrdiff_t{p});
  }
}

std::array<int, 9> nineOf(const sensor::Points& places, int columns, int rows) {
  const double quarter = 0.5 * std::sqrt(3.0);  // of a grid's width, in standard deviations of its places
  const Eigen::Vector2d middle = places.topRows<2>().rowwise().mean();
  const Eigen::Vector2d apart =
      quarter * (places.topRows<2>().colwise() - middle).cwiseAbs2().rowwise().mean().cwiseSqrt();
  std::array<int, 9> nine{};
  for (int i = 0; i < 9; ++i) {
    int& place = nine[i];
    if (std::min(columns, rows) >= 4) {
      place = (1 + i / 3) * rows / 4 * columns + (1 + i % 3) * columns / 4;
      continue;
    }
    const Eigen::Vector2d wanted = middle + apart.cwiseProduct(Eigen::Vector2d(i % 3 - 1, i / 3 - 1));
    (places.topRows<2>().colwise() - wanted).colwise().squaredNorm().minCoeff(&place);
  }
  return nine;
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
