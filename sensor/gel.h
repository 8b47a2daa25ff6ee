// What the sensor's body is made of, and where its markers and force nodes are.
//
// Gel frame (right-handed, metres): the origin lies on the touched surface at the centre of the marker field, x points
// to the right and y up in the camera's picture, z into the gel, towards the camera. A force is the force of the
// object on the gel, so pressing is +z.
#pragma once

#include <Eigen/Core>

#include <vector>

namespace sensor {

/// Points, one per column, gel frame, metres.
using Points = Eigen::Matrix3Xd;

/// Of the light in which markers stand out; grey: in all light.
enum class Colour { kBlue, kRed, kGreen, kGrey };

/// A linear elastic block: bonded to the camera side's window at z = size.z(), its four sides and its top free.
struct Gel {
  double youngsModulus = 0.18e6;                   ///< [Pa]
  double poissonRatio = 0.49;                      ///< below 0.5
  Eigen::Vector3d size = {100e-3, 100e-3, 40e-3};  ///< width, height, thickness [m]; centred on the origin in x, y
};

/// A rectangular grid of round markers in one plane z = depth.
/// Index of a marker in its layer: row * columns + column, column along +x, row along +y.
struct MarkerLayer {
  Colour colour = Colour::kBlue;
  int columns = 24;
  int rows = 24;
  double pitch = 3e-3;                               ///< [m]
  double depth = 6e-3;                               ///< [m]
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();  ///< of the grid [m]
  double diameter = 0.6e-3;                          ///< of a marker [m]
  bool darker = false;                               ///< than what surrounds the markers, in their light

  int count() const { return columns * rows; }
  Eigen::Vector3d position(int column, int row) const;  ///< [m]
};

/// The grid of force nodes on the touched surface. Index: row * columns + column, as for markers.
struct NodeGrid {
  int columns = 24;
  int rows = 24;
  double pitch = 3e-3;                               ///< [m]
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();  ///< [m]

  int count() const { return columns * rows; }
  Eigen::Vector3d position(int column, int row) const;  ///< [m], z = 0
};

/// All markers in the order used everywhere: layer after layer, each in its own index order. 3 x count.
Points markerPositions(const std::vector<MarkerLayer>& layers);

/// 3 x count.
Points nodePositions(const NodeGrid& grid);

/// The paper's two layers: blue at 6 mm, red at 8 mm shifted by half a pitch in x and y.
std::vector<MarkerLayer> paperLayers();

}  // namespace sensor
