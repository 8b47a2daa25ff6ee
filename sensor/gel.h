// The gel, its markers and its force nodes.
//
// Gel frame (right-handed, metres): the origin lies on the touched surface at the centre of the marker field; x points
// right and y up in the camera's picture, z into the gel, towards the camera. A force is the force of the object on the
// gel: pressing is +z.
#pragma once

#include <Eigen/Core>

#include <vector>

namespace sensor {

/// Points, one per column, gel frame, metres.
using Points = Eigen::Matrix3Xd;

/// Colour of the light in which markers stand out; kGrey: they stand out in all light.
enum class Colour { kBlue, kRed, kGreen, kGrey };

/// Returns the lower-case English name, such as "blue", as messages and gel files spell it. Never null.
const char* nameOf(Colour colour);

/// A linear elastic block. It is bonded to the window at z = size.z(); its four sides and the touched surface are free.
struct Gel {
  double youngsModulus = 0.18e6;  ///< [Pa]
  double poissonRatio = 0.49;     ///< below 0.5
  /// Width, height, thickness [m]; the block is centred on the origin in x, y.
  Eigen::Vector3d size = {100e-3, 100e-3, 40e-3};
};

/// A rectangular grid of round markers in the plane z = depth.
/// Index of a marker in its layer: row * columns + column, columns along +x, rows along +y.
struct MarkerLayer {
  Colour colour = Colour::kBlue;
  int columns = 24;                                  ///< number of markers along x
  int rows = 24;                                     ///< number of markers along y
  double pitch = 3e-3;                               ///< distance between neighbours in x and in y [m]
  double depth = 6e-3;                               ///< z of the markers' centres [m]
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();  ///< of the grid, gel frame [m]
  double diameter = 0.6e-3;                          ///< [m]
  bool darker = false;  ///< true: markers are darker than their surroundings in the light of `colour`

  int count() const { return columns * rows; }  ///< Returns the number of markers.
};

/// The grid of force nodes on the touched surface z = 0. Index: row * columns + column, as for markers.
struct NodeGrid {
  int columns = 24;                                  ///< number of nodes along x
  int rows = 24;                                     ///< number of nodes along y
  double pitch = 3e-3;                               ///< distance between neighbours in x and in y [m]
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();  ///< of the grid, gel frame [m]

  int count() const { return columns * rows; }  ///< Returns the number of nodes.
};

/// Returns the centres of all markers, 3 x M, gel frame [m], in the order used everywhere: layer after layer, each in
/// its own index order.
Points markerPositions(const std::vector<MarkerLayer>& layers);

/// Returns the places of all nodes, 3 x N, gel frame [m], z = 0, in index order.
Points nodePositions(const NodeGrid& grid);

/// Returns the paper's two layers: blue at a depth of 6 mm, red at 8 mm shifted by half a pitch in x and y.
std::vector<MarkerLayer> paperLayers();

}  // namespace sensor
