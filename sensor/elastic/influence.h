// The influence matrix of a sensor in image space: pixels of marker displacement per newton at the force nodes.
#pragma once

#include "sensor/elastic/block.h"
#include "sensor/sensor.h"

namespace sensor::elastic {

enum class Model { kBlock, kHalfSpace };

/// H [px/N], 2 M x 3 N: rows 2m, 2m+1 are (u, v) of marker m, columns 3n..3n+2 the forces (x, y, z) of node n.
/// Each pair of rows is the projection's Jacobian at the marker's rest position times three displacement rows.
Eigen::MatrixXd influenceMatrix(const Sensor& sensor, Model model, const Progress& progress = {});

}  // namespace sensor::elastic
