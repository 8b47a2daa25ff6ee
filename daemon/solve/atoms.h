// Makes the atoms of the model of contacts (docs/mathematics.md, 4.1): forces that are spread over points of
// the surface, from a single point to the whole face.
#pragma once

#include "sensor/sensor.h"

#include <Eigen/SparseCore>

#include <algorithm>
#include <array>
#include <span>
#include <vector>

namespace tractiond::solve {

/// Number of motions of the whole picture: shift along u and v, scale and roll.
inline constexpr int kMotions = 4;

/// Number of couples that forces may have besides those of the points, three components each [N m]: of each round patch
/// what its wrench has more than its forces at the points, a moment where these do not reach its place. They are
/// numbered like points, after the last one.
inline constexpr int kCouples = 4;

/// Atoms of one size. Neighbours among them have similar prior variances.
struct Level {
  int first = 0, end = 0;  ///< its atoms: first .. end - 1
  double spacing_m = 0.0;  ///< distance between neighbours
  double reach_m = 0.0;    ///< distance over which Roughness averages the pressure beneath its atoms
  bool ambiguous = false;  ///< the picture hardly distinguishes its atoms
};

/// P points and A atoms, the first P of which are the points themselves. Immutable once made; any thread may read it.
struct Atoms {
  sensor::Points points;              ///< 3 x P [m], gel frame; of a block a grid row after row, as its nodes are
  int columns = 0, rows = 0;          ///< size of that grid; 0 for a body
  double pitch_m = 0.0;               ///< of the nodes
  std::vector<int> nodes;             ///< P: index of the node at the point, or -1
  std::vector<int> nearest;           ///< P: the point on the nearest node
  sensor::Points places;              ///< 3 x A [m], centres of the atoms
  Eigen::SparseMatrix<double> shape;  ///< P x A: share of each point in an atom's force; the sum of a column is 1
  /// (P + kCouples) x A, N x A: the same shares, row after row; a couple has none.
  Eigen::SparseMatrix<double, Eigen::RowMajor> ofPoints, ofNodes;
  Eigen::Matrix<double, 6, Eigen::Dynamic> wrench;  ///< of unit forces of the atoms about the origin, 6 x 3A [1, m]
  std::vector<Level> levels;
  double depth_m = 0.0;  ///< depth of the nearest markers: they do not resolve forces that are closer together

  /// Returns P.
  int pointCount() const { return static_cast<int>(shape.rows()); }
  /// Returns A.
  int count() const { return static_cast<int>(shape.cols()); }
  /// Returns whether an atom belongs to an ambiguous level.
  bool isAmbiguous(int atom) const;
  int nodeCount() const;  ///< Returns N, the number of nodes of the sensor.
  /// Returns the index of the node at which a point's force is published.
  int nodeOf(int point) const { return nodes[nearest[point]]; }
};

/// Makes the atoms of a sensor, which need not outlive them. Of a block: points on the nodes and, where the gel is wide
/// enough for them, on two rings around them; hats over the nodes with half widths and distances of 2, 4 and 8 pitches;
/// an even plate on all nodes; lines along the four sides, of the outermost nodes and of each ring, each line a row of
/// hats of 8 pitches. Of a body with an influence file, whose nodes need not be a grid and whose mechanics are known at
/// the nodes alone: points on the nodes.
Atoms makeAtoms(const sensor::Sensor& sensor);

/// Returns nine places that stand for all: of a grid, row after row, those a quarter of it apart; of a list, which is
/// not a grid of at least 4 x 4, those that seen along z are next to where a grid as wide has these.
/// \param places 3 x n, n > 0
std::array<int, 9> nineOf(const sensor::Points& places, int columns, int rows);

/// Calls use(point) for a point of a grid, row after row, and for those next to it.
template <typename Use>
void eachAround(int point, int columns, int rows, Use use) {
  const int row = point / columns, column = point % columns;
  for (int r = std::max(row - 1, 0); r <= std::min(row + 1, rows - 1); ++r) {
    for (int c = std::max(column - 1, 0); c <= std::min(column + 1, columns - 1); ++c) use(r * columns + c);
  }
}

/// Computes the forces of the points (3P [N]: x, y, z of each point) from the forces of the atoms (3A [N], likewise).
void addUp(const Atoms& atoms, std::span<const double> forces, std::span<double> pointForces);

/// Computes the forces of the nodes (3N [N]): each is the sum of the points (3P [N]) that Atoms::nodeOf() assigns to
/// it.
void addAtNodes(const Atoms& atoms, std::span<const double> pointForces, std::span<double> nodeForces);

}  // namespace tractiond::solve
