// Friction of a contact, from how far its shear is spread (Cattaneo 1938, Mindlin 1949).
//
// A ball that is pressed with P and pulled sideways with Q slips in a ring around a disc that sticks, of c / a of the
// contact's radius. Its shear lies farther out than its pressure, by R, the ratio of the mean squared distances:
//   Q = mu P (1 - (c/a)^3),   R = (1 - (c/a)^5) / (1 - (c/a)^3)      from 5/3, all sticks, to 1, all slips
// A priori the logarithm of mu is even between Q / P and kLargestFriction. Of a contact that is no ball R means less.
#pragma once

#include "touch/field.h"

#include <array>
#include <optional>

namespace touch {

/// The largest coefficient of friction that is considered.
inline constexpr double kLargestFriction = 3.0;

/// Median and 95 % interval.
struct Interval {
  double estimate = 0.0, low = 0.0, high = 0.0;
};

enum class SlipState {
  kUnknown,    ///< says nothing about slip: little of the friction is known
  kSticking,   ///< less than 0.9 of the shear is reached at which the contact slips
  kIncipient,  ///< more than that is as likely as not
  kSlipping,   ///< the contact has moved along its shear, and may bear no more
};

struct Slip {
  SlipState state = SlipState::kUnknown;
  Interval stickRatio;  ///< c / a
  /// A high end of kLargestFriction: the contact shows a lower bound only.
  Interval friction;
  double margin_N = 0.0;  ///< further shear until it slips, by the median of the friction
  /// Normal force that holds the shear by the low end of the friction, with a quarter in reserve.
  double holding_N = 0.0;
  double incipient = 0.0;  ///< probability that more than 0.9 of the shear is reached at which the contact slips
};

/// Returns what a contact shows of its friction; nothing, which says nothing of slip, if a force is not sure or R is
/// not known. Reentrant. \param moved_m how far it has moved of late, and the deviation of that
std::optional<Slip> partialSlip(const Observation& contact, const std::array<double, 2>& moved_m,
                                const std::array<double, 2>& movedDeviation_m);

/// Returns R of a stick ratio from 0 to 1.
double spreadRatio(double stickRatio);

}  // namespace touch
