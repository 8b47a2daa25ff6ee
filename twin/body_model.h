// Computes the motion of a body's markers under the contacts of a scenario, from the body's influence file.
#pragma once

#include "sensor/sensor.h"
#include "twin/scenario.h"

namespace twin {

/// A contact on a body. All is in the gel frame.
struct BodyLoad {
  Eigen::Vector3d place = Eigen::Vector3d::Zero();   ///< of the patch's centre on the touched surface [m]
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< there, into the body
  Eigen::Vector3d force = Eigen::Vector3d::Zero();   ///< [N]
  sensor::Points nodeForces;                         ///< 3 x N [N]
  bool isWithin = true;                              ///< the patch is within the outermost nodes but one
};

/// The touched surface between the force nodes, and loads on it. Place and influence are interpolated alike, in rows
/// and columns of the nodes, by cubic convolution (Keys 1981): a load moves smoothly from node to node, and force and
/// moment of the nodes' forces are those of the load. Immutable and reentrant.
class BodyModel {
 public:
  /// \param sensor has a body with at least 4 x 4 nodes
  explicit BodyModel(const sensor::Sensor& sensor);

  /// Divides the traction of a patch among the nodes, narrower by what a force is spread on its node's area. The
  /// contact's position is where its centre is seen along z; its force is along axes of which the third is the normal,
  /// and the others are x and y turned with it the shortest way; the torque is about the normal. A patch that is not
  /// within the nodes is moved into them.
  BodyLoad load(const Contact& contact, const ContactState& state) const;

  /// Returns the displacements of all markers, 3 x markers [m].
  /// \param nodeForces 3 x N [N]
  sensor::Points displacement(const sensor::Points& nodeForces) const;

  /// Returns the moment about the origin of forces on the nodes [N m].
  /// \param nodeForces as above
  Eigen::Vector3d moment(const sensor::Points& nodeForces) const;

 private:
  struct Spot;

  /// Interpolates at a column and a row between 1 and their number less 2.
  Spot at(const Eigen::Vector2d& grid) const;
  /// Returns the spot where along * place = target; the nearest to it that was found, if there is none.
  Spot find(const Eigen::Matrix<double, 2, 3>& along, const Eigen::Vector2d& target, Eigen::Vector2d grid) const;

  int columns_, rows_;
  sensor::Points nodes_, normals_;
  Eigen::VectorXd areas_;
  Eigen::MatrixXd influence_;  ///< 3 markers x 3 nodes [m/N]
};

}  // namespace twin
