// A box-shaped element with tensor-product polynomials through Gauss-Lobatto points, whose interior is condensed.
#pragma once

#include "sensor/gel.h"

#include <array>
#include <vector>

namespace sensor::elastic {

/// Position of a node in its element, 0..degree along each axis; also of a node or cell in a mesh.
using Lattice = std::array<int, 3>;

/// Returns the (degree + 1)^3 - (degree - 1)^3 nodes on the element's surface, called its shell.
std::vector<Lattice> shellNodes(int degree);

/// An element after elimination of its interior unknowns, which carry no load. Unknown 3 n + c is component c at shell
/// node n.
struct CondensedElement {
  int degree = 0;
  Eigen::MatrixXd stiffness;  ///< symmetric [N/m]
  /// Of each mirror class (spectral_element.cpp): the lower Cholesky factor of the interior's stiffness, and its
  /// inverse times the stiffness between interior (rows) and shell (columns).
  std::array<Eigen::MatrixXd, 8> factor, coupling;

  /// Returns the matrix that gives the displacement at points: rows are the shell's unknowns, column c * points + t is
  /// component c at point t.
  /// \param unit 3 x points in the element's coordinates [0, 1]^3
  Eigen::MatrixXd interpolation(const Points& unit) const;
};

/// Returns the condensed element. The term in the divergence is integrated with (degree - 1)^3 Gauss points, which
/// prevents locking as Poisson's ratio approaches 1/2; all other terms are integrated exactly. Reentrant.
/// \param degree >= 2 (asserted, as poissonRatio < 0.5)
/// \param size edge lengths [m]
/// \param youngsModulus [Pa]
CondensedElement condensedElement(int degree, const Eigen::Vector3d& size, double youngsModulus, double poissonRatio);

}  // namespace sensor::elastic
