// Inputs of a tracker besides the frames, as they took effect with one frame.
#pragma once

#include "daemon/records/marker_field.h"

namespace tractiond {

/// With the inputs of all frames, the frames and the first zero, the tracker computes the same fields again.
struct TrackerInputs {
  bool zeroBegun = false;    ///< a zero was requested: it is taken from this frame on
  bool zeroEnded = false;    ///< the request whose zero was being taken has been cancelled
  bool zeroForgone = false;  ///< it was cancelled while this frame was tracked, which would have completed the zero
  bool adopted = false;      ///< `zero` comes into force: a requested or an earlier one; or stays in force: the one
                             ///< taken since is rejected
  bool compared = false;     ///< the zero `comparedZero` was compared with the gel file, and is in force
  bool fits = false;         ///< result of that comparison
  Id comparedZero{};
  RestPose zero;

  /// Returns whether there is any input.
  bool any() const { return zeroBegun || zeroEnded || zeroForgone || adopted || compared; }

  /// Merges the inputs of the next frame into these, whose frame is not recorded: both then belong to the next frame.
  /// Of two zeros or comparisons the later one remains. Allocates nothing if `zero` has room for the new one.
  void add(const TrackerInputs& next) {
    zeroBegun = zeroBegun || next.zeroBegun;
    zeroEnded = zeroEnded || next.zeroEnded;
    zeroForgone = zeroForgone || next.zeroForgone;
    if (next.adopted) {
      adopted = true;
      zero = next.zero;
    }
    if (next.compared) {
      compared = true;
      comparedZero = next.comparedZero;
      fits = next.fits;
    }
  }

  /// Removes all inputs, but keeps the memory of `zero`.
  void clear() { zeroBegun = zeroEnded = zeroForgone = adopted = compared = fits = false; }

  bool operator==(const TrackerInputs&) const = default;
};

}  // namespace tractiond
