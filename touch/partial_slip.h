// Friction of a contact: what it bears, what it bore while it slid, and, of a ball, how far its shear is spread.
//
// What it bears. Shear Q and torque T slip together at about (Q / mu P)^2 + (T / mu P r)^2 = 1 (Goyal 1991, Howe and
// Cutkosky 1996), r the mean distance of the pressure from its centre. So mu is at least L / P, of the load
// L = sqrt(Q^2 + (T / r)^2), whatever touches: the model kBound.
//
// What it bore while it slid, or turned, along its load: then L / P is mu, of any contact: the model kSliding. It is
// kept while the contact lasts, until it slides again, goes elsewhere, or bears more.
//
// How far its shear is spread (Cattaneo 1938, Mindlin 1949): the model kBall, which is used where no slide was seen. A
// ball that is pressed with P and pulled sideways with Q slips in a ring around a disc that sticks, of c / a of the
// contact's radius. Its shear lies farther out than its pressure, by R, the ratio of the mean squared distances:
//   Q = mu P (1 - (c/a)^3),   R = (1 - (c/a)^5) / (1 - (c/a)^3)      from 5/3, all sticks, to 1, all slips
// Of a contact that is no ball R means less.
//
// While a contact lasts mu is one number, of which each frame k says something. Its R is off by n_k, which is new in
// each frame, and by h_k, which stays, though it differs as the shear grows. So what counts is by how much R is off on
// average, with weights that decay with the frame's age, and no average is surer than h:
//   r(mu) = sum w (R_k - R_k(mu)) / W ~ N(0, 1 / W + sum w h^2 / W),   w = decay / n^2,  W = sum w
// A priori ln mu is even between Q / P of the last frame and kLargestFriction.
//
// The relation holds for shear that grows under a force that stays. A frame in which Q / P has fallen says nothing new
// of mu: the shear was let go, or the contact is pressed harder. Torque slips the rim alike: c / a by L is within 0.03
// of that under torque alone (Lubkin 1951); R is not, and not used where torque is more than a small part of the load.
#pragma once

#include "touch/field.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace touch {

/// The largest coefficient of friction that is considered.
inline constexpr double kLargestFriction = 3.0;

using traction::Interval, traction::SlipModel, traction::SlipState;

/// Its `model` is kBall, kBound or kSliding. The alarm, kIncipient, is on from a probability of 0.8 in two frames that
/// more than 0.8 of the load is reached at which the contact slips, until that is below 0.1.
struct Slip : traction::Slip {
  double incipient = 0.0;  ///< that probability
};

/// How far a contact has moved of late, and the deviations of that.
struct Motion {
  std::array<double, 2> way_m{}, wayDeviation_m{};
  double turn_rad = 0.0, turnDeviation_rad = 0.0;
};

/// Joins what the frames of one contact say. Thread-bound.
class PartialSlip {
 public:
  /// Takes the next frame. Returns what is known of the friction now; nothing, which says nothing of slip, if load or
  /// normal force is not sure.
  /// \param time_ns not before that of the last frame
  /// \param moved what was known of another place is forgotten
  std::optional<Slip> see(const Observation& contact, std::int64_t time_ns, const Motion& moved);

 private:
  static constexpr std::size_t kSteps = 256;  ///< of ln mu
  struct Sums {                               ///< over the frames, of one mu
    double away = 0.0;                        ///< w (R_k - R_k(mu))
    double stays = 0.0;                       ///< w h^2
  };
  struct Load {
    double shear_N = 0.0, torque_N = 0.0;   ///< Q, T / r
    double all_N = 0.0, deviation_N = 0.0;  ///< L
    double least = 0.0;                     ///< L / P
    double noise = 0.0, form = 0.0;         ///< deviations of ln (L / P): new in each frame, and by what touches
    double logDeviation() const { return std::hypot(noise, form); }
    double low() const;  ///< of L / P
  };
  struct Slide {  ///< weighted means over the frames of a slide
    double weight = 0.0, logFriction = 0.0, logNormal = 0.0;
    double deviation = 0.0;  ///< of logFriction, that stays
    std::int64_t last_ns = 0;
  };

  static const std::array<double, kSteps>& frictions();
  static Load loadOf(const Observation& contact);
  bool slides(const Observation& contact, const Load& load, std::int64_t time_ns, const Motion& moved);
  bool isLoaded(double normal_N, const Load& load);
  void add(const Observation& contact, double least, std::int64_t time_ns);
  void addSlide(const Load& load, double normal_N, std::int64_t time_ns);
  double slideDeviation(double normal_N) const;
  double surelyBorne(double normal_N) const;
  double weigh(const Load& load, double normal_N, std::array<double, kSteps>& probability) const;
  void judge(const Load& load, double normal_N, Slip& slip) const;
  bool alarms(double incipient);

  std::array<Sums, kSteps> sums_{};
  double weight_ = 0.0;                     ///< W
  std::int64_t last_ns_ = 0;                ///< time of the last frame that was added
  double most_ = 0.0, mostNormal_N_ = 0.0;  ///< largest L / P, and its P
  double borne_ = 0.0;                      ///< the largest low end of that
  Slide slide_;
  int movedFrames_ = 0;
  int sure_ = 0;  ///< frames since the alarm is sure
  bool alarm_ = false;
};

/// Returns R of a stick ratio from 0 to 1.
double spreadRatio(double stickRatio);

}  // namespace touch
