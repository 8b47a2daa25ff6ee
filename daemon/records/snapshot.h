// A copy of one picture with the markers that the tracker found in it, and reduction of pictures for display.
#pragma once

#include "daemon/records/frame_copy.h"

#include <cstdint>
#include <vector>

namespace tractiond {

/// State of a marker in a picture.
enum class MarkerState : std::uint8_t {
  kSought,  ///< markers are not followed: its place is that of the zero, or of the gel file before there is a zero
  kFound,
  kLost,    ///< present in the zero, not found now: its place is interpolated from its neighbours
  kAbsent,  ///< not seen when the zero was taken
};

struct Snapshot : FrameCopy {
  // By marker, in the order of sensor::markerPositions.
  std::vector<float> place_px;  ///< 2 M, (u, v)
  std::vector<MarkerState> state;

  // Spots that resembled a marker of a layer when the whole picture was searched last.
  std::vector<float> spot_px;           ///< (u, v) of each
  std::vector<std::uint8_t> spotLayer;  ///< index of its layer
};

/// A picture with 8 bits per channel, rows without padding.
struct PlainPicture {
  int width = 0, height = 0;         ///< px
  int channels = 3;                  ///< 3: red, green, blue; 1: grey
  std::vector<std::uint8_t> levels;  ///< row after row from the top, channel after channel of each pixel
};

/// Converts a frame of any format that can be read to a picture of the same size, for display: takes the high 8 bits;
/// all four pixels of a 2 x 2 cell of a mosaic get the cell's colour; YUV becomes RGB (ITU-R BT.601, full range). Only
/// grey formats give one channel. Samples beyond Frame::size count as 0. The frame must have at least one pixel
/// (asserted), and its data must be valid during the call only. Reentrant.
PlainPicture plainPicture(const Frame& frame);

/// Writes plainPicture() reduced by `factor` to `to`: means of factor x factor pixels; incomplete blocks at the right
/// and the bottom are dropped. Width and height are those of the frame, divided by `factor` and rounded down. Reuses
/// the memory of `to`, and allocates that of two rows. Reentrant.
/// \param factor from 1 to the smaller side of the frame (asserted)
void reduce(const Frame& frame, int factor, PlainPicture& to);

}  // namespace tractiond
