// A copy of one picture, and what the tracker made of it.
#pragma once

#include "daemon/records/frame_copy.h"

#include <cstdint>
#include <vector>

namespace tractiond {

/// What has become of a marker.
enum class MarkerState : std::uint8_t {
  kSought,  ///< markers are not known yet: its place is where the gel file has it
  kFound,
  kLost,    ///< present in the zero, not found now: its place is where its neighbours have it
  kAbsent,  ///< not seen when the zero was taken
};

struct Snapshot : FrameCopy {
  // By marker, in the order of sensor::markerPositions.
  std::vector<float> place_px;  ///< 2 M, (u, v)
  std::vector<MarkerState> state;

  // Spots that look about like a marker of a layer, when the markers were last sought in the whole picture.
  std::vector<float> spot_px;           ///< (u, v) of each
  std::vector<std::uint8_t> spotLayer;  ///< of each
};

/// 8 bits a channel, rows without padding.
struct PlainPicture {
  int width = 0, height = 0;  ///< px
  int channels = 3;           ///< 3: red, green, blue; 1: grey
  std::vector<std::uint8_t> levels;
};

/// Of any format that can be read: the high 8 bits; colours of a mosaic from each cell of 2 x 2 pixels. For eyes.
PlainPicture plainPicture(const Frame& frame);

/// Of half the width and height: means of 2 x 2 pixels.
PlainPicture halved(const PlainPicture& picture);

/// Means of `factor` x `factor` pixels of the plain picture, of which whole ones alone count. `to` keeps its memory.
/// \param factor from 1 to the smaller side of the picture
void reduce(const Frame& frame, int factor, PlainPicture& to);

}  // namespace tractiond
