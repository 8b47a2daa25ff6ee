// What a tracker is told from outside while pictures come.
#pragma once

#include "daemon/records/marker_field.h"

namespace tractiond {

/// As one frame heeded it. With all of them, the frames and the zero at the start the tracker does the same again.
struct TrackerInputs {
  bool zeroBegun = false;    ///< a zero was asked for: it is taken from this frame on
  bool zeroEnded = false;    ///< the one that was being taken has been taken back
  bool zeroForgone = false;  ///< taken back while this frame was tracked, which would have been its last
  bool adopted = false;      ///< `zero` comes into force: one that was asked for and is kept, or one of before
  bool judged = false;       ///< the zero `judgedZero` was compared with the gel file
  bool fits = false;
  Id judgedZero{};
  RestPose zero;

  bool any() const { return zeroBegun || zeroEnded || zeroForgone || adopted || judged; }

  /// Those of the next frame come on top, where this one is left out.
  void add(const TrackerInputs& next) {
    zeroBegun = zeroBegun || next.zeroBegun;
    zeroEnded = zeroEnded || next.zeroEnded;
    zeroForgone = zeroForgone || next.zeroForgone;
    if (next.adopted) {
      adopted = true;
      zero = next.zero;
    }
    if (next.judged) {
      judged = true;
      judgedZero = next.judgedZero;
      fits = next.fits;
    }
  }

  /// Keeps the memory of `zero`.
  void clear() { zeroBegun = zeroEnded = zeroForgone = adopted = judged = fits = false; }
};

}  // namespace tractiond
