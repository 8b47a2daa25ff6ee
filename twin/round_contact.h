// A round object on the gel with Coulomb's friction, whatever way it has moved.
#pragma once

#include "sensor/gel.h"

#include <Eigen/Core>

#include <vector>

namespace twin {

/// Profile of a round object: flat in the middle (a ball: 0), then curved as a ball.
struct Profile {
  double flat = 0.0;         ///< radius of the flat part [m]
  double curvature = 25e-3;  ///< radius of the ball, or of the rounded edge [m]
};

/// Contact of a rigid round object with an elastic half-space, by the method of dimensionality reduction (Popov and
/// Heß 2015, chapters 3 and 5): the contact becomes a row of springs, each of which sticks or slips by itself. The row
/// has the force of the three-dimensional contact, and what its tractions follow from, for any history of motion, as
/// exactly as Cattaneo and Mindlin (tractions along the motion; none across). Slips of the tangential springs are
/// damped by the gel's own loss. Thread-bound.
class RoundContact {
 public:
  RoundContact(const sensor::Gel& gel, const Profile& profile, double friction);

  /// Moves the object.
  /// \param approach depth to which it is pressed into the gel, without deformation [m]; at most 0: it does not touch
  /// \param step of the object along the surface since the last call [m]
  /// \param duration of the step [s]
  void move(double approach, const Eigen::Vector2d& step, double duration);

  /// Returns the force of the object on the gel [N]: along the surface, and pressing.
  Eigen::Vector3d force() const { return force_; }
  /// Returns the radius of the contact [m]; 0 without contact.
  double radius() const { return radius_; }
  /// Returns the radius of what sticks over that of the contact, c / a: 0 if it slips as a whole.
  double stickRatio() const { return stickRatio_; }
  /// Returns the normal force at an approach [N].
  double normalForce(double approach) const;

  /// Outer radii of Hertz's pressures whose sum the tractions are [m], ascending.
  static std::vector<double> radii();
  /// Returns the force of each of these pressures, 3 x radii [N]; the sum of all is within 1 % of force().
  Eigen::Matrix3Xd parts() const;

 private:
  struct Spring {
    double height = 0.0;  ///< of the reduced profile: the approach at which it comes into contact [m]
    Eigen::Vector2d strain = Eigen::Vector2d::Zero();  ///< of the tangential spring [m]
    Eigen::Vector3d force = Eigen::Vector3d::Zero();   ///< per length [N/m]
  };

  double normal_, tangential_;  ///< reduced moduli E* and G* [Pa]
  double friction_;
  std::vector<Spring> springs_;  ///< outwards, half of the row
  Eigen::Vector3d force_ = Eigen::Vector3d::Zero();
  double radius_ = 0.0, stickRatio_ = 1.0;
};

}  // namespace twin
