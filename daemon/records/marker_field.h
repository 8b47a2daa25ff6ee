// What the tracker says of one frame.
#pragma once

#include "daemon/records/frame.h"

#include <array>
#include <string>
#include <vector>

namespace tractiond {

using Id = std::array<std::uint8_t, 16>;  ///< a 128-bit hash; all zero: none

/// Reasons for a reader to be careful; bits, as on the wire.
enum Flags : std::uint32_t {
  kZeroUnverified = 1U << 0,  ///< nobody has confirmed, and no unloaded picture has shown, that the zero is a zero
  kFewMarkers = 1U << 1,      ///< fewer than track.min_valid_fraction of the markers are valid: the field is not valid
  kDiscontinuity = 1U << 2,   ///< frames were lost or the clocks jumped before this frame
  kReacquiring = 1U << 3,     ///< markers were labelled anew in this frame
  kTorn = 1U << 4,            ///< the picture does not hang together: rows of another moment, or moved aside
  kUnexplained = 1U << 5,     ///< the picture shows displacements that no forces on the surface can make
  kOutOfRange = 1U << 6,      ///< the forces are beyond the range for which the uncertainty is known
  kGelMismatch = 1U << 7,     ///< the rest picture contradicts the gel file: the field is not valid
  kDoubtedOrigin = 1U << 8,   ///< packets came twice, early, or beside the camera's own: the picture may be another's
};

/// The rest pose: where each marker of the unloaded gel is in the picture, and how it looks there.
/// Sizes M = number of markers, in the order of sensor::markerPositions.
struct RestPose {
  std::vector<float> position_px;     ///< 2 M, (u, v)
  std::vector<float> amplitude;       ///< M, grey levels of the marker above its surroundings
  std::vector<std::uint8_t> present;  ///< M, 1: seen in the rest frames
  std::vector<float> oddity;  ///< M, rms of what the marker's template leaves unexplained beyond the noise, as a
                              ///< share of the amplitude; empty: not known
  float noise = 0.0F;         ///< standard deviation of a pixel between rest frames, grey levels
  float shotNoise = 0.0F;     ///< by how much its variance grows with each grey level of light
  float light = 0.0F;         ///< mean light at the markers' rims, where `noise` is stated, grey levels
  /// Share of the other layer's colour that each layer's shows, in the order blue, red, green: of red seen in blue,
  /// then of blue in red. 0 where colours do not tell the layers apart.
  std::array<float, 2> crossTalk{};
  std::int64_t taken_ns = 0;  ///< CLOCK_REALTIME of the last rest frame
  bool requested = false;     ///< taken because a person asked for it; false: by itself at the first start
  Id id{};                    ///< hash of all of the above
  std::string requestedBy;    ///< who asked, for people
};

/// Displacements of all markers in one frame. Sized once, reused.
struct MarkerField {
  FrameInfo info;
  std::vector<float> displacement_px;  ///< 2 M, (u, v): right and down in the picture, from the rest pose
  std::vector<float> variance_px2;     ///< M, of each coordinate
  std::vector<std::uint8_t> valid;     ///< M, 0 or 1; where 0 the two above mean nothing (and are 0)
  std::uint32_t flags = 0;
  int validCount = 0;
  int isolatedGaps = 0;  ///< markers that the zero lacks, while it has at least four of the eight around each of them
  Id zero{};  ///< the rest pose it rests on

  void resize(int markers);
};

}  // namespace tractiond
