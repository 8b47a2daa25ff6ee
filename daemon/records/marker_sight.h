// Numbers of markers that the tracker sees.
#pragma once

#include "daemon/records/gel_report.h"

#include <array>

namespace tractiond {

/// Numbers of one frame.
struct MarkerSight {
  struct Layer {
    int expected = 0;  ///< markers of the gel file
    int found = 0;     ///< markers found in this frame, also before there is a zero
    int inZero = 0;    ///< markers present in the zero in force; 0: no zero
    LatticeSeen seen;  ///< when the markers were labelled last; 0: never
  };
  std::array<Layer, 2> layers{};
  int layerCount = 0;
  bool following = false;  ///< true: the markers are followed from one frame to the next

  /// The search for a first zero; does not change any more once there is one.
  struct FirstZero {
    int frames = 0;     ///< frames in which markers were found while there was no zero
    int mostStill = 0;  ///< most of them in a row without motion
    // Of those that were given up last because their light had a trend.
    float brighter = 0.0F, moreContrast = 0.0F;  ///< change over them, share of the mean
    int changedOver = 0;                         ///< number of them
  };
  FirstZero firstZero;
};

}  // namespace tractiond
