#include "sensor/gel.h"

namespace sensor {

namespace {

template <typename Grid>
Eigen::Vector2d gridPosition(const Grid& grid, int column, int row) {
  return grid.centre + grid.pitch * Eigen::Vector2d(column - 0.5 * (grid.columns - 1), row - 0.5 * (grid.rows - 1));
}

template <typename Grid>
void appendPositions(const Grid& grid, Points& points, Eigen::Index& next) {
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) points.col(next++) = grid.position(column, row);
  }
}

}  // namespace

Eigen::Vector3d MarkerLayer::position(int column, int row) const {
  Eigen::Vector3d point;
  point << gridPosition(*this, column, row), depth;
  return point;
}

Eigen::Vector3d NodeGrid::position(int column, int row) const {
  Eigen::Vector3d point;
  point << gridPosition(*this, column, row), 0.0;
  return point;
}

Points markerPositions(const std::vector<MarkerLayer>& layers) {
  Eigen::Index count = 0;
  for (const MarkerLayer& layer : layers) count += layer.count();
  Points points(3, count);
  Eigen::Index next = 0;
  for (const MarkerLayer& layer : layers) appendPositions(layer, points, next);
  return points;
}

Points nodePositions(const NodeGrid& grid) {
  Points points(3, grid.count());
  Eigen::Index next = 0;
  appendPositions(grid, points, next);
  return points;
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
