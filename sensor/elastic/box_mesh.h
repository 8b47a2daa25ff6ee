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

  int degree() const { return degree_; }  ///< of the elements' polynomials
  /// Returns the number of cells along an axis.
  int cells(int axis) const { return static_cast<int>(planes_[axis].size()) - 1; }
  int last(int axis) const { return cells(axis) * degree_; }  ///< lattice position of the last node along an axis
  int nodeCount() const { return static_cast<int>(lattice_.size()); }  ///< number of nodes with a number
  /// Returns the number of the node at a lattice position; -1 for a node inside an element.
  int number(const Lattice& place) const { return numbers_[index(place)]; }
  /// Returns the lattice position of the node with this number.
  const Lattice& place(int number) const { return lattice_[number]; }

  // Cells count from 0 along each axis. Positions and cells outside the mesh are not checked.
  Eigen::Vector3d position(const Lattice& place) const;  ///< of a node [m]
  Eigen::Vector3d corner(const Lattice& cell) const;     ///< corner with the smallest coordinates [m]
  Eigen::Vector3d size(const Lattice& cell) const;       ///< edge lengths [m]
  Lattice cellAt(const Eigen::Vector3d& point) const;    ///< cell of a point [m], or the nearest one

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

  bool isCell() const { return first == last; }  ///< the range is a single cell
  /// Splits the range across its longest axis; returns the low half first. isCell() must be false.
  std::pair<CellRange, CellRange> halves() const;
  std::vector<Lattice> cells() const;  ///< depth first through the tree of halves, low halves first
  bool owns(const BoxMesh& mesh, const Lattice& place) const;  ///< true: no cell outside this range has the node
};

}  // namespace sensor::elastic
