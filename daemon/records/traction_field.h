// What the solver says of one frame: the message that is published.
#pragma once

#include "daemon/records/marker_field.h"

namespace tractiond {

/// Forces of the object on the gel, gel frame (x right, y up in the picture, z into the gel), SI. Sized once, reused.
struct TractionField {
  MarkerField markers;                    ///< a copy of what the numbers were solved from
  std::vector<float> force_N;             ///< 3 N, node after node (x, y, z)
  bool valid = false;                     ///< false: too few markers or a numeric failure; all numbers are 0
  std::array<double, 3> resultant_N{};    ///< sum of the node forces
  std::array<double, 3> moment_Nm{};      ///< about the origin
  std::array<double, 2> centreOfPressure_m{};  ///< of the normal forces
  bool centreOfPressureValid = false;     ///< false where the normal force is too small for a centre
  double residual_px = 0.0;               ///< root mean square over the valid markers' coordinates
  std::uint32_t flags = 0;

  void resize(int markerCount, int nodeCount);
};

}  // namespace tractiond
