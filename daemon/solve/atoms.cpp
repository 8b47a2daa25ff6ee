#include "daemon/solve/atoms.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

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

/// Collects atoms level by level.
class Builder {
 public:
  explicit Builder(Atoms& atoms)
      : atoms_(atoms) {}

  /// `share` of a point in the next atom.
  void add(Index point, double share) { entries_.emplace_back(point, static_cast<Index>(places_.size()), share); }
  /// Ends an atom.
  void place(const Eigen::Vector3d& at) { places_.push_back(at); }
  /// Ends a level.
  void level(double spacing_m) {
    const int first = atoms_.levels.empty() ? 0 : atoms_.levels.back().end;
    atoms_.levels.push_back({first, static_cast<int>(places_.size()), spacing_m});
  }
  void finish() {
    atoms_.places.resize(3, static_cast<Index>(places_.size()));
    for (std::size_t a = 0; a < places_.size(); ++a) atoms_.places.col(static_cast<Index>(a)) = places_[a];
    atoms_.shape.resize(atoms_.points.cols(), atoms_.places.cols());
    atoms_.shape.setFromTriplets(entries_.begin(), entries_.end());
  }

 private:
  Atoms& atoms_;
  std::vector<Eigen::Triplet<double>> entries_;
  std::vector<Eigen::Vector3d> places_;
};

void addPoints(const Atoms& atoms, double pitch_m, Builder& builder) {
  for (Index p = 0; p < atoms.points.cols(); ++p) {
    builder.add(p, 1.0);
    builder.place(atoms.points.col(p));
  }
  builder.level(pitch_m);
}

void addHats(const sensor::NodeGrid& nodes, int ring, int scale, Builder& builder) {
  const Hats across = hatsAlong(nodes.columns, ring, scale), along = hatsAlong(nodes.rows, ring, scale);
  const Index columns = across.heights.rows();
  for (Index j = 0; j < along.centres.size(); ++j) {
    for (Index i = 0; i < across.centres.size(); ++i) {
      for (Index row = 0; row < along.heights.rows(); ++row) {
        for (Index column = 0; column < columns; ++column) {
          const double share = along.heights(row, j) * across.heights(column, i);
          if (share > 0.0) builder.add(row * columns + column, share);
        }
      }
      const Eigen::Vector2d at = nodes.centre + nodes.pitch * Eigen::Vector2d(across.centres[i], along.centres[j]);
      builder.place({at.x(), at.y(), 0.0});
    }
  }
  builder.level(scale * nodes.pitch);
}

void addPlate(const Atoms& atoms, const sensor::NodeGrid& nodes, Builder& builder) {
  for (Index p = 0; p < atoms.points.cols(); ++p) {
    if (atoms.nodes[static_cast<std::size_t>(p)] >= 0) builder.add(p, 1.0 / nodes.count());
  }
  builder.place({nodes.centre.x(), nodes.centre.y(), 0.0});
  builder.level(std::max(nodes.columns, nodes.rows) * nodes.pitch);
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
  Atoms atoms;
  Builder builder(atoms);
  if (sensor.body) {
    atoms.points = sensor.body->nodes;
    for (int n = 0; n < sensor.nodes.count(); ++n) atoms.nodes.push_back(n);
    atoms.depth_m = markerDistance(*sensor.body);
    addPoints(atoms, sensor.nodes.pitch, builder);
    builder.finish();
    return atoms;
  }
  const sensor::NodeGrid& nodes = sensor.nodes;
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
  atoms.depth_m = std::numeric_limits<double>::max();
  for (const sensor::MarkerLayer& layer : sensor.layers) atoms.depth_m = std::min(atoms.depth_m, layer.depth);
  addPoints(atoms, nodes.pitch, builder);
  for (const int scale : kScales) addHats(nodes, ring, scale, builder);
  addPlate(atoms, nodes, builder);
  builder.finish();
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
