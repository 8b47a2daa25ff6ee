// How many markers the tracker sees.
#pragma once

#include "daemon/records/gel_report.h"

#include <array>

namespace tractiond {

/// Of one frame.
struct MarkerSight {
  struct Layer {
    int expected = 0;  ///< of the gel file
    int found = 0;     ///< in this frame; before there is a zero as well
    int inZero = 0;    ///< present in the zero in force
    int spots = 0;     ///< of about a marker's look and colour, where they were last sought in the whole picture
    LatticeSeen seen;  ///< when the markers were labelled last; 0: never
  };
  std::array<Layer, 2> layers{};
  int layerCount = 0;
  bool following = false;  ///< the markers are known from one frame to the next

  /// The search for a first zero; as it was at the end, once there is one.
  struct FirstZero {
    int frames = 0;     ///< in which markers were found while there was no zero
    int mostStill = 0;  ///< longest row of them without motion
  };
  FirstZero firstZero;
};

}  // namespace tractiond
