// A box of tensor-product elements: which nodes it has, and a tree of halves over its cells.
#pragma once

#include "sensor/elastic/spectral_element.h"

#include <utility>
#include <vector>

namespace sensor::elastic {

/// Cells along each axis between `planes`. Nodes are found by their place in the lattice of all nodes; only those on
/// the surface of some element have a number.
class BoxMesh {
 public:
  BoxMesh(int degree, std::array<std::vector<double>, 3> planes);

  int degree() const { return degree_; }
  int cells(int axis) const { return static_cast<int>(planes_[axis].size()) - 1; }
  int last(int axis) const { return cells(axis) * degree_; }  ///< place of the last node
  int nodeCount() const { return static_cast<int>(lattice_.size()); }
  int number(const Lattice& place) const { return numbers_[index(place)]; }  ///< -1 inside an element
  const Lattice& place(int number) const { return lattice_[number]; }

  Eigen::Vector3d position(const Lattice& place) const;  ///< [m]
  Eigen::Vector3d corner(const Lattice& cell) const;     ///< the one nearest to the origin [m]
  Eigen::Vector3d size(const Lattice& cell) const;       ///< [m]
  Lattice cellAt(const Eigen::Vector3d& point) const;    ///< the nearest cell

 private:
  std::size_t index(const Lattice& place) const;

  int degree_;
  std::array<std::vector<double>, 3> planes_;
  std::array<Eigen::VectorXd, 3> coordinates_;
  std::vector<int> numbers_;
  std::vector<Lattice> lattice_;
};

/// Cells first..last along each axis, last included.
struct CellRange {
  Lattice first, last;

  bool isCell() const { return first == last; }
  std::pair<CellRange, CellRange> halves() const;              ///< across the longest axis
  std::vector<Lattice> cells() const;                          ///< in the order of the tree of halves
  bool owns(const BoxMesh& mesh, const Lattice& place) const;  ///< no cell outside has this node
};

}  // namespace sensor::elastic
