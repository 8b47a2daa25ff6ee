// Friction of a contact, from how far its shear is spread (Cattaneo 1938, Mindlin 1949).
//
// A ball that is pressed with P and pulled sideways with Q slips in a ring around a disc that sticks, of c / a of the
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
// of mu: the shear was let go, or the contact is pressed harder.
#pragma once

#include "touch/field.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace touch {

/// The largest coefficient of friction that is considered.
inline constexpr double kLargestFriction = 3.0;

/// Median and 95 % interval.
struct Interval {
  double estimate = 0.0, low = 0.0, high = 0.0;
};

enum class SlipState {
  kUnknown,   ///< says nothing about slip: little of the friction is known
  kSticking,  ///< none of the others
  /// The alarm: more than 0.8 of the shear is reached at which the contact slips, with a probability of 0.8 in two
  /// frames; until that is below 0.1.
  kIncipient,
  kSlipping,  ///< the contact has moved along its shear, and may bear no more
};

struct Slip {
  SlipState state = SlipState::kUnknown;
  Interval stickRatio;  ///< c / a
  /// A high end of kLargestFriction: the contact shows a lower bound only.
  Interval friction;
  double margin_N = 0.0;  ///< further shear until it slips, by the median of the friction
  /// Normal force that holds the shear by the low end of the friction, with a quarter in reserve.
  double holding_N = 0.0;
  double incipient = 0.0;  ///< probability that more than 0.8 of the shear is reached at which the contact slips
};

/// Joins what the frames of one contact say. Thread-bound.
class PartialSlip {
 public:
  /// Takes the next frame. Returns what is known of the friction now; nothing, which says nothing of slip, if a force
  /// is not sure or R was not known of late. \param time_ns not before that of the last frame \param moved_m how far
  /// the contact has moved of late, and the deviation of that; what was known of another place is forgotten
  std::optional<Slip> see(const Observation& contact, std::int64_t time_ns, const std::array<double, 2>& moved_m,
                          const std::array<double, 2>& movedDeviation_m);

 private:
  static constexpr std::size_t kSteps = 256;  ///< of ln mu
  struct Sums {                               ///< over the frames, of one mu
    double away = 0.0;                        ///< w (R_k - R_k(mu))
    double stays = 0.0;                       ///< w h^2
  };

  static const std::array<double, kSteps>& frictions();
  double secondsSince(std::int64_t time_ns) const {  ///< since the last frame that was added
    return 1e-9 * (static_cast<double>(time_ns) - static_cast<double>(last_ns_));
  }
  bool isLoaded(double normal_N, double least);
  void add(const Observation& contact, double least, std::int64_t time_ns);
  double weigh(double least, double noise, std::array<double, kSteps>& probability) const;
  bool alarms(double incipient);

  std::array<Sums, kSteps> sums_{};
  double weight_ = 0.0;                     ///< W
  std::int64_t last_ns_ = 0;                ///< time of the last frame that was added
  double most_ = 0.0, mostNormal_N_ = 0.0;  ///< largest Q / P, and its P
  int movedFrames_ = 0;
  int sure_ = 0;  ///< frames since the alarm is sure
  bool alarm_ = false;
};

/// Returns R of a stick ratio from 0 to 1.
double spreadRatio(double stickRatio);

}  // namespace touch
