// The influence matrix of a sensor in image space: pixels of marker displacement per newton at the force nodes.
#pragma once

#include "sensor/elastic/block.h"
#include "sensor/sensor.h"

namespace sensor::elastic {

/// Mechanics of a sensor without a body of its own.
enum class Model { kBlock, kHalfSpace };

/// 3 M x 3 N [m/N], of a block or a half-space: rows 3m.. are the displacement of marker m, columns 3n.. the unit
/// forces along x, y, z at node n.
Eigen::MatrixXd displacementMatrix(const Gel& gel, Model model, const Points& markers, const Points& nodes,
                                   const BlockOptions& options = {}, const Progress& progress = {});

/// The same of a sensor's markers and nodes; of a body, its own, as stiff as the gel.
Eigen::MatrixXd displacementMatrix(const Sensor& sensor, Model model, const Progress& progress = {});

/// The same seen by the sensor's camera, 2 M x columns [px/N]: each pair of rows is the projection's Jacobian at the
/// marker's rest position times its three displacement rows.
Eigen::MatrixXd toImage(const Sensor& sensor, const Eigen::MatrixXd& displacement);

/// H [px/N], 2 M x 3 N: rows 2m, 2m+1 are (u, v) of marker m, columns 3n..3n+2 the forces (x, y, z) of node n.
Eigen::MatrixXd influenceMatrix(const Sensor& sensor, Model model, const Progress& progress = {});

/// 2 M x 4: how the markers' pixels move with a shift of the whole picture along u and v [px/px], with its scale
/// [px per 1] and its roll from u towards v [px/rad], both about the principal point.
Eigen::MatrixXd pictureMotionMatrix(const Sensor& sensor);

}  // namespace sensor::elastic
