// A box divided into tensor-product elements: the numbering of its nodes, and a tree of halves over its cells.
#pragma once

#include "sensor/elastic/spectral_element.h"

#include <utility>
#include <vector>

namespace sensor::elastic {

/// Divides a box into cells at `planes` along each axis; each cell is an element. A node is identified by its position
/// in the lattice of all nodes. Only nodes on the surface of an element also have a number, from 0 on. Immutable.
class BoxMesh {
 public:
  /// \param degree of the elements' polynomials, at least 1
  /// \param planes element boundaries along each axis, ascending [m], at least two
  BoxMesh(int degree, std::array<std::vector<double>, 3> planes);

  int degree() const { return degree_; }  ///< Returns the degree of the elements' polynomials.
  /// Returns the number of cells along an axis.
  int cells(int axis) const { return static_cast<int>(planes_[axis].size()) - 1; }
  /// Returns the lattice position of the last node along an axis.
  int last(int axis) const { return cells(axis) * degree_; }
  /// Returns the number of nodes with a number.
  int nodeCount() const { return static_cast<int>(lattice_.size()); }
  /// Returns the number of the node at a lattice position; -1 for a node inside an element.
  int number(const Lattice& place) const { return numbers_[index(place)]; }
  /// Returns the lattice position of the node with this number.
  const Lattice& place(int number) const { return lattice_[number]; }

  // Cells count from 0 along each axis. Positions and cells outside the mesh are not checked.
  Eigen::Vector3d position(const Lattice& place) const;  ///< Returns where the node at a lattice position is [m].
  Eigen::Vector3d corner(const Lattice& cell) const;     ///< Returns a cell's corner of smallest coordinates [m].
  Eigen::Vector3d size(const Lattice& cell) const;       ///< Returns a cell's edge lengths [m].
  /// Returns the cell of a point [m], between two the one with larger coordinates; outside the box the nearest one.
  Lattice cellAt(const Eigen::Vector3d& point) const;

 private:
  std::size_t index(const Lattice& place) const;

  int degree_;
  std::array<std::vector<double>, 3> planes_;
  std::array<Eigen::VectorXd, 3> coordinates_;
  std::vector<int> numbers_;
  std::vector<Lattice> lattice_;
};

/// Cells first..last along each axis, both included.
struct CellRange {
  Lattice first, last;

  bool isCell() const { return first == last; }  ///< Returns whether the range is a single cell.
  /// Splits the range across its longest axis; returns the low half first. isCell() must be false.
  std::pair<CellRange, CellRange> halves() const;
  /// Returns all cells, depth first through the tree of halves, low halves first.
  std::vector<Lattice> cells() const;
  /// Returns whether no cell outside this range has the node at a lattice position.
  bool owns(const BoxMesh& mesh, const Lattice& place) const;
};

}  // namespace sensor::elastic
