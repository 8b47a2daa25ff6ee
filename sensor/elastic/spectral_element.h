// A box-shaped hexahedron of tensor-product polynomials through Gauss-Lobatto points, its interior condensed.
#pragma once

#include "sensor/gel.h"

#include <array>
#include <vector>

namespace sensor::elastic {

/// Position of a node in its element: 0..degree along each axis.
using Lattice = std::array<int, 3>;

/// The (degree + 1)^3 - (degree - 1)^3 nodes on the element's surface.
std::vector<Lattice> shellNodes(int degree);

/// What is left of an element when its interior unknowns, which carry no load, are expressed by those of its shell.
/// Unknown 3 n + c is component c at shell node n.
struct CondensedElement {
  int degree = 0;
  Eigen::MatrixXd stiffness;  ///< lower triangle [N/m]
  Eigen::MatrixXd factor;     ///< lower Cholesky factor of the interior's stiffness
  Eigen::MatrixXd coupling;   ///< factor^-1 times the stiffness between interior (rows) and shell

  /// Displacement at points given in [0, 1]^3 of the element: column c * points + t belongs to component c at point t,
  /// rows are the shell's unknowns.
  Eigen::MatrixXd interpolation(const Points& unit) const;
};

/// The div-div term is integrated with (degree - 1)^3 Gauss points, which leaves room for motions of constant volume
/// (no locking as Poisson's ratio approaches 1/2), the rest exactly. size: edges [m]; moduli in Pa.
CondensedElement condensedElement(int degree, const Eigen::Vector3d& size, double youngsModulus, double poissonRatio);

}  // namespace sensor::elastic
