// A gripper of two fingers and an object on a table: what a controller that closes, lifts and holds would see.
//
// Frame of the hand: x from the first finger to the second, z up, the origin at the middle of the gels' touched
// surfaces. On both gels y is up; x is to the left of who looks at the gel's touched surface from the object. The
// object does not turn, and stays in the middle between the fingers.
#pragma once

#include "twin/round_contact.h"

#include <array>
#include <vector>

namespace twin {

/// An event, counted from the moment at which the object leaves the table.
struct Disturbance {
  double at_s = 0.0, duration_s = 0.1;
  Eigen::Vector2d force = Eigen::Vector2d::Zero();         ///< on the object, half a sine: a bump (y, z) [N]
  Eigen::Vector2d acceleration = Eigen::Vector2d::Zero();  ///< of the hand, a whole sine: a jerk (y, z) [m/s^2]
  double mass = 0.0;                                       ///< added, for good [kg]
};

struct HandOptions {
  // The gripper. Both motions are followed as by a drive: critically damped, within these limits.
  double opening = 80e-3, height = 0.0;    ///< at the start: between the gels; of the hand above its lowest place [m]
  double speed = 0.1, acceleration = 2.0;  ///< [m/s], [m/s^2]
  // The object.
  double mass = 60e-3;     ///< [kg]
  double friction = 0.5;   ///< coefficient
  double width = 50e-3;    ///< between its two faces [m]
  Profile profile;         ///< of each face
  double stiffness = 1e5;  ///< of each face [N/m]
  double breaking = 1e9;   ///< normal force at which it breaks [N]
  std::vector<Disturbance> disturbances;
};

/// The hand's motion, and the object's. Thread-bound.
class Hand {
 public:
  Hand(const HandOptions& options, const sensor::Gel& gel);

  /// Sets where the gripper shall go: opening and height [m].
  void command(double opening, double height);
  /// Advances the time [s].
  void advance(double duration);

  struct State {
    double time_s = 0.0;
    double opening = 0.0, height = 0.0;               ///< of the gripper [m]
    Eigen::Vector2d place = Eigen::Vector2d::Zero();  ///< of the object on the gels: (y, z) in the hand [m]
    double clearance = 0.0;  ///< of the object above the table [m]; negative: it is pressed on it
    double friction = 0.0;   ///< coefficient
    double mass = 0.0;       ///< [kg]
    double slid = 0.0;       ///< way on the gels since it left the table [m]
    bool lifted = false, dropped = false, broken = false;  ///< has been so
    double normal = 0.0;                                   ///< of each finger [N]
    Eigen::Vector2d carried = Eigen::Vector2d::Zero();     ///< force of both fingers on the object (y, z) [N]
  };
  const State& state() const { return state_; }

  /// Contact of a finger, whose forces are in its own gel's frame.
  const RoundContact& contact(int finger) const { return fingers_[static_cast<std::size_t>(finger)]; }
  /// Returns the place of the object on a finger's gel [m].
  Eigen::Vector2d position(int finger) const { return onGel(finger, state_.place); }

  static constexpr double kReach = 12e-3;  ///< farthest place of the object from the middle of the gels [m]

 private:
  struct Drive {
    double at = 0.0, speed = 0.0, target = 0.0;
    void advance(double duration, const HandOptions& limits);
  };

  static Eigen::Vector2d onGel(int finger, const Eigen::Vector2d& place) {
    return {finger == 0 ? -place.x() : place.x(), place.y()};
  }
  void step(double duration);
  double approach();

  HandOptions options_;
  std::array<RoundContact, 2> fingers_;
  Drive opening_, height_;
  Eigen::Vector2d velocity_ = Eigen::Vector2d::Zero();  ///< of the object in the hand
  double overlap_ = 0.0, approach_ = 0.0;               ///< of the last step, of both faces [m]
  double lifted_s_ = 0.0;
  State state_;
};

}  // namespace twin
