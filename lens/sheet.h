// Draws the markers of a gel at true scale, for printing and transfer.
#pragma once

#include "sensor/sensor.h"

#include <cstddef>
#include <string>

namespace lens {

/// Returns one layer of markers as SVG 1.1: a page in millimetres with one circle per marker (in the group "markers")
/// in the order of markerPositions, a registration cross beyond each corner at the same place on all sheets of the
/// sensor, the outline of the gel (of a block only), and a ruler of 50 mm. On paper x points right and y up, as in the
/// camera's picture; mirrored, x points left. The gel frame's origin is at the centre of the page's width, and 6 mm
/// above the centre of its height.
/// \param layer index from 0, below layers.size() (not checked)
/// \param mirrored true: for a transfer that turns the print over; false: as seen through the window
std::string sheet(const sensor::Sensor& sensor, std::size_t layer, bool mirrored = false);

/// Returns width and height of the page, the same for all sheets of a sensor [m].
Eigen::Vector2d pageSize(const sensor::Sensor& sensor);

}  // namespace lens
