// Friction of a contact, from how far its shear is spread (Cattaneo 1938, Mindlin 1949).
//
// A ball that is pressed with P and pulled sideways with Q slips in a ring around a disc that sticks, of c / a of the
// contact's radius. Its shear lies farther out than its pressure, by R, the ratio of the mean squared distances:
//   Q = mu P (1 - (c/a)^3),   R = (1 - (c/a)^5) / (1 - (c/a)^3)      from 5/3, all sticks, to 1, all slips
// A priori the logarithm of mu is even between Q / P and kLargestFriction. Of a contact that is no ball R means less.
#pragma once

namespace touch {

/// The largest coefficient of friction that is considered.
inline constexpr double kLargestFriction = 3.0;

/// Median and 95 % interval.
struct Interval {
  double estimate = 0.0, low = 0.0, high = 0.0;
};

/// A contact under shear. Deviations are standard deviations.
struct Sheared {
  double normal_N = 0.0, normalDeviation_N = 0.0;
  double shear_N = 0.0, shearDeviation_N = 0.0;
  double spreadRatio = 0.0, spreadRatioDeviation = 0.0;  ///< R; deviation 0: not known
};

enum class SlipState {
  kUnknown,    ///< says nothing about slip
  kSticking,   ///< less than 0.9 of the shear is reached at which it slips
  kIncipient,  ///< more than 0.9 of that shear is as likely as not reached
  kSlipping,   ///< the contact has moved along its shear, and may bear no more
};

struct PartialSlip {
  /// False: a force is not sure, or R is not known; the numbers are 0. Says nothing about slip.
  bool known = false;
  Interval stickRatio;  ///< c / a
  /// A high end of kLargestFriction: the contact shows a lower bound only.
  Interval friction;
  double margin_N = 0.0;  ///< further shear until it slips, by the median of the friction
  /// Normal force that holds the shear by the low end of the friction, with a quarter in reserve.
  double holding_N = 0.0;
  double incipient = 0.0;  ///< probability that more than 0.9 of the shear is reached at which the contact slips
};

/// Returns what a contact shows of its friction. Reentrant.
PartialSlip partialSlip(const Sheared& contact);

/// Returns the state of a contact. \param moved_m how far it has moved along its shear of late
SlipState slipState(const PartialSlip& slip, double moved_m, double movedDeviation_m);

/// Returns R of a stick ratio from 0 to 1.
double spreadRatio(double stickRatio);

}  // namespace touch
