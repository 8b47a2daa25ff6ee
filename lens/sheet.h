// The markers of a gel on paper, at true scale: what is printed and transferred.
#pragma once

#include "sensor/sensor.h"

#include <cstddef>
#include <string>

namespace lens {

struct SheetOptions {
  bool mirrored = false;  ///< for a transfer that turns the print over; else as seen through the window
};

/// One layer of markers as SVG 1.1: a page in millimetres, one circle a marker in the order of markerPositions, a cross
/// beyond each corner that is the same on all layers' sheets (and those of the half-way points), the outline of the
/// gel, and a ruler of 50 mm. On paper x points to the right and y up, as in the camera's picture; mirrored, to the
/// left. The gel frame's origin is the middle of the page. \param layer below layers.size()
std::string sheet(const sensor::Sensor& sensor, std::size_t layer, const SheetOptions& options = {});

/// Of the page, all sheets of a sensor alike [m].
Eigen::Vector2d pageSize(const sensor::Sensor& sensor);

}  // namespace lens
