// Computes the influence matrix of a sensor: pixels of marker displacement per newton at the force nodes. All functions
// are reentrant.
#pragma once

#include "sensor/elastic/block.h"
#include "sensor/sensor.h"

namespace sensor::elastic {

/// Mechanics of a sensor that has no body of its own.
enum class Model { kBlock, kHalfSpace };

/// Returns the displacements of a block or half-space per unit force, 3 M x 3 N [m/N]: rows 3m.. are the displacement
/// of marker m, columns 3n.. the unit forces along x, y, z at node n. Takes seconds for a block. No marker may coincide
/// with a node (not checked): the result is not finite there.
/// \param markers 3 x M, gel frame [m]
/// \param nodes 3 x N, gel frame [m], z = 0
/// \param degree BlockOptions::degree, of a block only
Eigen::MatrixXd displacementMatrix(const Gel& gel, Model model, const Points& markers, const Points& nodes,
                                   int degree = kBlockDegree, const Progress& progress = {});

/// Returns the same for a sensor's markers and nodes. For a sensor with a body: the body's matrix, scaled to the gel's
/// Young's modulus, whatever `model` is.
Eigen::MatrixXd displacementMatrix(const Sensor& sensor, Model model, const Progress& progress = {});

/// Projects displacements into the sensor's camera, 2 M x columns [px/N]: each pair of rows is the Jacobian of the
/// projection at the marker's rest position times the marker's three rows.
/// \param displacement 3 M x columns [m/N]; with [m] the result is in [px]; its rows must be those of the sensor's
/// markers (not checked)
Eigen::MatrixXd toImage(const Sensor& sensor, const Eigen::MatrixXd& displacement);

/// Returns the motion of the markers' pixels per motion of the whole picture, 2 M x 4: shift along u and v [px/px],
/// scale [px per 1] and roll from u towards v [px/rad], the last two about the principal point.
Eigen::MatrixXd pictureMotionMatrix(const Sensor& sensor);

}  // namespace sensor::elastic
