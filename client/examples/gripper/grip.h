// Decides how a gripper with two feeling fingers picks up a thing of which nothing is known: closes until it touches,
// and raises the hand while it presses ever harder. The fingers slide until friction carries the thing: the ratio of
// shear to normal force, while they slid, is the coefficient of friction. From then on it holds by weight and friction.
#pragma once

#include <algorithm>
#include <cmath>

namespace grip {

/// What a finger feels in one frame.
struct Finger {
  bool touches = false;
  double normal_N = 0.0, across_N = 0.0, up_N = 0.0;  ///< pressing; on the thing, sideways and up
  bool slides = false;                                ///< it moves along the shear
};

struct Target {
  double opening_m = 0.0, height_m = 0.0;
};

struct Options {
  double firstTouch_N = 0.3;  ///< normal force at which raising begins
  double mostNormal_N = 5.0;  ///< is never exceeded: things break, and the gel has its range
  double jerk_m_s2 = 3.0;     ///< acceleration of the hand that is to be held, beyond gravity
  double reserve = 1.12;      ///< normal force over the least that holds: for errors of the friction
  double height_m = 40e-3;    ///< to which it lifts
  double hold_s = 6.0;        ///< for which it holds there
};

class Grip {
 public:
  enum class Phase { kClose, kProbe, kLift, kHold, kLower, kOpen, kDone, kFailed };

  Grip(const Options& options, double opening_m)
      : options_(options)
      , target_{opening_m, 0.0}
      , start_m_(opening_m) {}

  Phase phase() const { return phase_; }              ///< Returns what the gripper does now.
  double friction() const { return friction_; }       ///< Returns the friction that was found; 0: none yet.
  double weight_N() const { return 2 * carried_N_; }  ///< Returns the weight of the thing.
  double wanted_N() const { return wanted_N_; }       ///< Returns the normal force that each finger is to have.

  /// Takes what both fingers feel, `dt_s` after the last time, and returns where to go.
  Target step(const Finger& a, const Finger& b, double dt_s) {
    const bool touches = a.touches && b.touches;
    const double normal_N = 0.5 * (a.normal_N + b.normal_N);
    const double up_N = 0.5 * (a.up_N + b.up_N);
    const double shear_N = std::hypot(up_N, 0.5 * (a.across_N + b.across_N));
    since_s_ += dt_s;
    smooth(smoothNormal_N_, normal_N, dt_s);
    smooth(smoothShear_N_, shear_N, dt_s);
    switch (phase_) {
    case Phase::kClose:
      if (!touches) target_.opening_m -= kClosing_m_s * dt_s;
      if (target_.opening_m <= 0.0) fail();  // there is nothing
      if (touches) press(options_.firstTouch_N, normal_N, dt_s);
      if (touches && std::abs(normal_N - options_.firstTouch_N) < 0.2 * options_.firstTouch_N) settled_s_ += dt_s;
      if (settled_s_ > 0.2) enter(Phase::kProbe);
      break;
    case Phase::kProbe:
      target_.height_m += kProbing_m_s * dt_s;
      friction_ = std::max(friction_, smoothShear_N_ / std::max(smoothNormal_N_, 0.05));
      if (smoothShear_N_ > 1.03 * carried_N_) {
        carried_N_ = smoothShear_N_;
        grown_N_ = smoothNormal_N_;
      }
      // It hangs once more normal force brings no more shear.
      if (smoothNormal_N_ > 1.15 * grown_N_ && since_s_ > 0.5 && carried_N_ > 0.02) {
        carried_N_ = smoothShear_N_;
        enter(Phase::kLift);
      } else {
        press(wanted_N_ + (since_s_ > 0.4 ? kPressing_N_s * dt_s : 0.0), normal_N, dt_s);
        if (wanted_N_ > options_.mostNormal_N) fail();  // it is too heavy, or too slippery
      }
      break;
    case Phase::kLift:
      hold(normal_N, shear_N, a.slides || b.slides, dt_s);
      if (since_s_ > 0.3) target_.height_m = std::min(target_.height_m + kLifting_m_s * dt_s, options_.height_m);
      if (target_.height_m >= options_.height_m) enter(Phase::kHold);
      break;
    case Phase::kHold:
      hold(normal_N, shear_N, a.slides || b.slides, dt_s);
      if (since_s_ > options_.hold_s) enter(Phase::kLower);
      break;
    case Phase::kLower:
      hold(normal_N, shear_N, false, dt_s);
      target_.height_m -= (target_.height_m > 5e-3 ? kLifting_m_s : 2 * kProbing_m_s) * dt_s;
      if (up_N < 0.3 * carried_N_ || target_.height_m < -5e-3) enter(Phase::kOpen);
      break;
    case Phase::kOpen:
      target_.opening_m = std::min(target_.opening_m + kClosing_m_s * dt_s, start_m_);
      if (target_.opening_m >= start_m_) enter(Phase::kDone);
      break;
    default:
      break;
    }
    const bool carries = phase_ > Phase::kProbe && phase_ < Phase::kOpen;
    lost_s_ = carries && !touches ? lost_s_ + dt_s : 0.0;
    if (lost_s_ > 0.3) fail();  // it fell
    return target_;
  }

 private:
  static constexpr double kClosing_m_s = 5e-3, kProbing_m_s = 1e-3, kLifting_m_s = 20e-3;
  static constexpr double kPressing_N_s = 1.0;
  static constexpr double kYield_m_N_s = 15e-3;  // speed of the opening for each newton that is missing
  static constexpr double kSmoothing_s = 0.08, kWeighing_s = 0.5;

  void enter(Phase phase) {
    phase_ = phase;
    since_s_ = 0.0;
    settled_s_ = 0.0;
  }

  void fail() {
    enter(Phase::kFailed);
    target_.opening_m = start_m_;
  }

  static void smooth(double& value, double now, double dt_s, double over_s = kSmoothing_s) {
    value += (now - value) * std::min(dt_s / over_s, 1.0);
  }

  /// Moves the fingers so that each will press with `wanted_N`.
  void press(double wanted_N, double normal_N, double dt_s) {
    wanted_N_ = wanted_N;
    target_.opening_m -= kYield_m_N_s * (wanted_N - normal_N) * std::min(dt_s, 1 / 30.0);
  }

  void hold(double normal_N, double shear_N, bool slides, double dt_s) {
    if (slides) caution_ = std::min(caution_ + dt_s, 1.5);
    smooth(carried_N_, shear_N, dt_s, kWeighing_s);
    const double most = std::max(carried_N_ * (1 + options_.jerk_m_s2 / 9.81), shear_N);
    press(std::min(caution_ * options_.reserve * most / friction_, options_.mostNormal_N), normal_N, dt_s);
  }

  Options options_;
  Target target_;
  double start_m_;
  Phase phase_ = Phase::kClose;
  double since_s_ = 0.0, settled_s_ = 0.0, lost_s_ = 0.0;
  double smoothNormal_N_ = 0.0, smoothShear_N_ = 0.0;
  double friction_ = 0.0, carried_N_ = 0.0, grown_N_ = 0.0, wanted_N_ = 0.0, caution_ = 1.0;
};

}  // namespace grip
