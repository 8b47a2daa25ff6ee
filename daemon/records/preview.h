// The newest picture, reduced, as it travels to whoever wants to see it.
#pragma once

#include "daemon/records/marker_field.h"
#include "daemon/records/snapshot.h"

namespace tractiond {

struct Preview {
  PlainPicture picture;
  int factor = 1;  ///< pixels of the camera to one of this picture, in each direction
  FrameInfo info;
  std::uint32_t flags = 0;  ///< of the frame's markers
  Id zero{};                ///< from which they are counted
};

}  // namespace tractiond
