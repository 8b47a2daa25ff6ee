// The newest picture, reduced, as it travels to subscribers.
#pragma once

#include "daemon/records/marker_field.h"
#include "daemon/records/snapshot.h"

namespace tractiond {

struct Preview {
  PlainPicture picture;
  int factor = 1;  ///< camera pixels per pixel of this picture, in each direction
  FrameInfo info;
  std::uint32_t flags = 0;  ///< MarkerField::flags of the frame; 0: not tracked
  Id zero{};                ///< MarkerField::zero of the frame
};

}  // namespace tractiond
