#include "sensor/gel.h"

#include <array>

namespace sensor {

namespace {

/// Returns the points of a grid at one depth, in index order.
Points positions(const auto& grid, double depth) {
  Points points(3, grid.count());
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const Eigen::Vector2d steps(column - 0.5 * (grid.columns - 1), row - 0.5 * (grid.rows - 1));
      points.col(row * grid.columns + column) << grid.centre + grid.pitch * steps, depth;
    }
  }
  return points;
}

}  // namespace

const char* nameOf(Colour colour) {
  constexpr std::array kNames = {"blue", "red", "green", "grey"};
  return kNames[static_cast<std::size_t>(colour)];
}

Points markerPositions(const std::vector<MarkerLayer>& layers) {
  Points points(3, 0);
  for (const MarkerLayer& layer : layers) {
    points.conservativeResize(3, points.cols() + layer.count());
    points.rightCols(layer.count()) = positions(layer, layer.depth);
  }
  return points;
}

Points nodePositions(const NodeGrid& grid) {
  return positions(grid, 0.0);
}

std::vector<MarkerLayer> paperLayers() {
  MarkerLayer blue;
  MarkerLayer red = blue;
  red.colour = Colour::kRed;
  red.depth = 8e-3;
  red.centre = {1.5e-3, 1.5e-3};
  return {blue, red};
}

}  // namespace sensor
