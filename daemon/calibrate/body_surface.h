// The touched surface of a body between its force nodes, for contacts that lie anywhere on it.
#pragma once

#include "sensor/sensor.h"

namespace tractiond::calibrate {

/// Coordinates on the surface are lengths along rows and columns of the grid of nodes, from its middle, of which a step
/// from node to node is `pitch` long [m]. Between the nodes all quantities are interpolated by the same cubic splines.
/// Immutable and reentrant.
class BodySurface {
 public:
  static constexpr int kFewest = 4;  ///< columns and rows of nodes

  /// The sensor has a body, with at least kFewest columns and rows of nodes (asserted), and need not outlive this.
  explicit BodySurface(const sensor::Sensor& sensor);

  /// A round contact on the surface.
  struct Patch {
    Eigen::VectorXd shares;  ///< N: of its force at each node; their sum is 1
    Eigen::Vector3d place;   ///< of its centre, gel frame [m]
    Eigen::Vector3d normal;  ///< there, into the body
  };

  /// Divides a contact of one traction's direction, with Hertz's pressure, among the nodes.
  /// \param shape coordinates of its centre on the surface, radius [m], as bounded() returns them
  Patch patch(const Eigen::Vector3d& shape) const;

  /// Returns the shape nearest to this one that lies within the nodes, and is not smaller than a force on one node is
  /// spread over.
  Eigen::Vector3d bounded(const Eigen::Vector3d& shape) const;

  /// Returns the coordinates of the node that is seen nearest to a place along z.
  /// \param place x, y, gel frame [m]
  Eigen::Vector2d nearest(const Eigen::Vector2d& place) const;

  double pitch() const { return pitch_; }  ///< Returns the mean distance of the nodes [m].

 private:
  struct Spot;
  Spot at(const Eigen::Vector2d& place) const;

  int columns_, rows_;
  double pitch_, spread_;  ///< spread_: radius of the contact as broad as a force on a node [m]
  sensor::Points nodes_, normals_;
  Eigen::MatrixXd ofColumns_, ofRows_;  ///< coefficients of the splines by the values at the nodes
};

}  // namespace tractiond::calibrate
