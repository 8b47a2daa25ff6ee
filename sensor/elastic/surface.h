// How the touched surface itself moves under the forces of the nodes, each spread evenly over its own part of the face.
#pragma once

#include "sensor/elastic/block.h"

namespace sensor::elastic {

/// 3 x 3 [m/N], as halfSpaceDisplacement: of the surface z = 0 at `offset` from the centre of a square of side `side`
/// [m] that carries the unit force evenly. Boussinesq's and Cerruti's fields, integrated in closed form (Love, Phil.
/// Trans. A 228, 1929). Finite everywhere. Reentrant.
Eigen::Matrix3d halfSpaceSquare(const Eigen::Vector2d& offset, double side, double youngsModulus, double poissonRatio);

/// 3 N x 3 N [m/N]: rows 3t.. are the displacement of the surface at node t, columns 3s.. the unit forces at node s,
/// spread over squares of side `pitch`. Of a block: base bonded, sides free; its correction is that of forces in
/// points, from which the squares differ at the sides and the base by less than (pitch / distance)^2 / 12. Needs
/// seconds.
Eigen::MatrixXd surfaceMatrix(const Gel& gel, const Points& nodes, double pitch, const BlockOptions& options = {},
                              const Progress& progress = {});

}  // namespace sensor::elastic
