#include "sensor/elastic/box_mesh.h"

#include "sensor/elastic/quadrature.h"

#include <algorithm>

namespace sensor::elastic {

BoxMesh::BoxMesh(int degree, std::array<std::vector<double>, 3> planes)
    : degree_(degree)
    , planes_(std::move(planes)) {
  const Eigen::VectorXd lobatto = gaussLobatto(degree + 1).points;
  for (int d = 0; d < 3; ++d) {
    coordinates_[d].resize(last(d) + 1);
    for (int cell = 0; cell < cells(d); ++cell)
      coordinates_[d].segment(cell * degree, degree + 1) =
          planes_[d][cell] + 0.5 * (planes_[d][cell + 1] - planes_[d][cell]) * (1.0 + lobatto.array());
  }
  numbers_.assign(static_cast<std::size_t>((last(0) + 1) * (last(1) + 1) * (last(2) + 1)), -1);
  for (int k = 0; k <= last(2); ++k)
    for (int j = 0; j <= last(1); ++j)
      for (int i = 0; i <= last(0); ++i)
        if (i % degree == 0 || j % degree == 0 || k % degree == 0) {
          numbers_[index({i, j, k})] = nodeCount();
          lattice_.push_back({i, j, k});
        }
}

std::size_t BoxMesh::index(const Lattice& place) const {
  return static_cast<std::size_t>(place[0] + (last(0) + 1) * (place[1] + (last(1) + 1) * place[2]));
}

Eigen::Vector3d BoxMesh::position(const Lattice& place) const {
  return {coordinates_[0][place[0]], coordinates_[1][place[1]], coordinates_[2][place[2]]};
}

Eigen::Vector3d BoxMesh::corner(const Lattice& cell) const {
  return {planes_[0][cell[0]], planes_[1][cell[1]], planes_[2][cell[2]]};
}

Eigen::Vector3d BoxMesh::size(const Lattice& cell) const {
  return corner({cell[0] + 1, cell[1] + 1, cell[2] + 1}) - corner(cell);
}

Lattice BoxMesh::cellAt(const Eigen::Vector3d& point) const {
  Lattice cell;
  for (int d = 0; d < 3; ++d) {
    const auto above = std::upper_bound(planes_[d].begin() + 1, planes_[d].end() - 1, point[d]);
    cell[d] = static_cast<int>(above - planes_[d].begin()) - 1;
  }
  return cell;
}

std::pair<CellRange, CellRange> CellRange::halves() const {
  int axis = 0;
  for (int d = 1; d < 3; ++d)
    if (last[d] - first[d] > last[axis] - first[axis]) axis = d;
  std::pair parts = {*this, *this};
  parts.first.last[axis] = (first[axis] + last[axis]) / 2;
  parts.second.first[axis] = parts.first.last[axis] + 1;
  return parts;
}

std::vector<Lattice> CellRange::cells() const {
  if (isCell()) return {first};
  const auto [a, b] = halves();
  std::vector<Lattice> all = a.cells();
  for (const Lattice& cell : b.cells()) all.push_back(cell);
  return all;
}

bool CellRange::owns(const BoxMesh& mesh, const Lattice& place) const {
  for (int d = 0; d < 3; ++d) {
    const int lowest = std::max(place[d] - 1, 0) / mesh.degree();
    const int highest = std::min(place[d] / mesh.degree(), mesh.cells(d) - 1);
    if (lowest < first[d] || highest > last[d]) return false;
  }
  return true;
}

}  // namespace sensor::elastic
