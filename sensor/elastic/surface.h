// Computes the motion of the touched surface under the node forces, each spread evenly over its node's square.
#pragma once

#include "sensor/elastic/block.h"

namespace sensor::elastic {

/// Returns the displacement per unit force [m/N], 3 x 3, of the half-space's surface z = 0 under a force spread evenly
/// over a square. Column j belongs to a force along axis j. Integrates Boussinesq's and Cerruti's fields in closed form
/// (Love, Phil. Trans. A 228, 1929). The result is finite everywhere. Reentrant.
/// \param offset point - centre of the square [m]
/// \param side of the square [m]
/// \param youngsModulus [Pa]
Eigen::Matrix3d halfSpaceSquare(const Eigen::Vector2d& offset, double side, double youngsModulus, double poissonRatio);

/// Returns the displacement of a block's surface per unit force, 3 N x 3 N [m/N]: rows 3t.. are the displacement at
/// node t, columns 3s.. the unit forces at node s, spread over squares of side `pitch` [m]. Base bonded, sides free.
/// The correction w is that of point forces; it differs from that of squares, at the sides and the base, by less than
/// (pitch / distance)^2 / 12. Takes seconds. Reentrant. An exception of `progress` ends it and is passed on.
/// \param nodes 3 x N, gel frame [m], z = 0, at least one (not checked)
Eigen::MatrixXd surfaceMatrix(const Gel& gel, const Points& nodes, double pitch, const Progress& progress = {});

}  // namespace sensor::elastic
