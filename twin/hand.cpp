#include "twin/hand.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace twin {

namespace {

constexpr double kGravity = 9.80665;    // [m/s^2]
constexpr double kStep = 1e-4;          // [s]
constexpr double kFollowing = 60.0;     // [1/s] of the drives
constexpr double kTable = 2e4;          // stiffness [N/m]
constexpr double kTableDamping = 20.0;  // [N s/m]
constexpr double kLift = 0.5e-3;        // clearance from which on the object counts as lifted [m]

}  // namespace

void Hand::Drive::advance(double duration, const HandOptions& limits) {
  const double wanted = kFollowing * kFollowing * (target - at) - 2 * kFollowing * speed;
  speed += duration * std::clamp(wanted, -limits.acceleration, limits.acceleration);
  speed = std::clamp(speed, -limits.speed, limits.speed);
  at += duration * speed;
}

Hand::Hand(const HandOptions& options, const sensor::Gel& gel)
    : options_(options)
    , fingers_{RoundContact(gel, options.profile, options.friction),
               RoundContact(gel, options.profile, options.friction)}
    , opening_{options.opening, 0.0, options.opening}
    , height_{options.height, 0.0, options.height} {
  state_.opening = options.opening;
  state_.height = options.height;
  state_.friction = options.friction;
  state_.mass = options.mass;
  state_.clearance = -options.mass * kGravity / kTable;
  state_.place.y() = state_.clearance - options.height;
}

void Hand::command(double opening, double height) {
  opening_.target = std::max(opening, 0.0);
  height_.target = std::max(height, 0.0);
}

/// Returns the depth of each face in its gel, as the object gives way as well. The force grows ever faster with the
/// depth, so Newton's method comes down from the overlap.
double Hand::approach() {
  const double overlap = 0.5 * (options_.width - opening_.at);
  if (overlap == overlap_) return approach_;
  overlap_ = approach_ = overlap;
  if (overlap <= 0.0) return approach_;
  constexpr double kDifference = 1e-9, kExact = 1e-12;  // [m]
  for (double change = 1.0; change > kExact;) {
    const double force = fingers_[0].normalForce(approach_);
    const double rise = (fingers_[0].normalForce(approach_ + kDifference) - force) / kDifference;
    change = (approach_ + force / options_.stiffness - overlap) / (1.0 + rise / options_.stiffness);
    approach_ -= change;
  }
  return approach_;
}

void Hand::step(double duration) {
  opening_.advance(duration, options_);
  const double speedBefore = height_.speed;
  height_.advance(duration, options_);
  state_.time_s += duration;
  state_.mass = options_.mass;
  Eigen::Vector2d push(0.0, -(height_.speed - speedBefore) / duration);  // acceleration in the hand
  Eigen::Vector2d bump = Eigen::Vector2d::Zero();
  for (const Disturbance& disturbance : options_.disturbances) {
    const double since = state_.time_s - lifted_s_ - disturbance.at_s;
    if (!state_.lifted || since < 0.0) continue;
    state_.mass += disturbance.mass;
    if (since >= disturbance.duration_s) continue;
    const double phase = std::numbers::pi * since / disturbance.duration_s;
    bump += std::sin(phase) * disturbance.force;
    push -= std::sin(2 * phase) * disturbance.acceleration;
  }
  push.y() -= kGravity;
  push += bump / state_.mass;

  const double clearance = state_.place.y() + height_.at;
  const bool touchesTable = clearance < 0.0;
  Eigen::Vector2d carried(state_.carried);
  if (touchesTable) {
    const double speed = velocity_.y() + height_.speed;
    carried.y() += std::max(-kTable * clearance - kTableDamping * speed, 0.0);
    carried.x() -= kTableDamping * velocity_.x();  // friction, which keeps what is not held in place
  }
  velocity_ += duration * (carried / state_.mass + push);
  Eigen::Vector2d moved = duration * velocity_;
  state_.place += moved;
  state_.clearance = state_.place.y() + height_.at;

  const double depth = state_.place.norm() < kReach ? approach() : 0.0;
  state_.carried.setZero();
  for (int finger = 0; finger < 2; ++finger) {
    RoundContact& contact = fingers_[static_cast<std::size_t>(finger)];
    contact.move(depth, onGel(finger, moved), duration);
    state_.carried -= onGel(finger, contact.force().head<2>());
  }
  state_.normal = fingers_[0].force().z();
  const bool held = state_.normal > 0.0;
  if (!state_.lifted && held && state_.clearance > kLift) {
    state_.lifted = true;
    lifted_s_ = state_.time_s;
  }
  if (state_.lifted && held) {
    if (fingers_[0].stickRatio() == 0.0) state_.slid += moved.norm();
  }
  // An object that is put down touches the table while it is held.
  state_.dropped = state_.dropped || (state_.lifted && !held && state_.clearance > kLift);
  state_.broken = state_.broken || state_.normal > options_.breaking;
}

void Hand::advance(double duration) {
  const int steps = std::max(1, static_cast<int>(std::ceil(duration / kStep - 1e-9)));
  for (int i = 0; i < steps; ++i) step(duration / steps);
  state_.opening = opening_.at;
  state_.height = height_.at;
}

}  // namespace twin
