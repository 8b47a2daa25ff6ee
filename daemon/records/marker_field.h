// The tracker's result for one frame, and the rest pose that it refers to.
#pragma once

#include "daemon/records/frame.h"
#include "daemon/records/rest_drift.h"

#include <array>
#include <string>
#include <vector>

namespace tractiond {

using Id = std::array<std::uint8_t, 16>;  ///< a 128-bit hash; all zero: none

/// Bits of a message's flags, as on the wire. Each is a reason for caution.
enum Flags : std::uint32_t {
  kZeroUnverified = 1U << 0,  ///< neither an operator nor an unloaded picture has confirmed the zero
  kFewMarkers = 1U << 1,      ///< too few markers are valid, by track.min_valid_fraction, or in the flags of a field by
                              ///< solve.max_missing_fraction: the field is not valid
  kDiscontinuity = 1U << 2,   ///< the frame before has no field, or ids or clock jumped: FieldGaps
  kReacquiring = 1U << 3,     ///< markers were labelled anew in this frame
  kTorn = 1U << 4,            ///< the picture is inconsistent: some rows are shifted or belong to another frame
  kUnexplained = 1U << 5,     ///< the picture shows displacements that no forces on the surface can cause
  kOutOfRange = 1U << 6,      ///< the forces exceed the range in which the uncertainty is known
  kGelMismatch = 1U << 7,     ///< the rest picture contradicts the gel file: the field is not valid
  /// Packets arrived twice, early, or in addition to the camera's own: the picture may come from another sender.
  kDoubtedOrigin = 1U << 8,
  /// No model of an earlier frame holds, and this frame's own was not solved in time: the field is not valid.
  kNotSolved = 1U << 9,
  /// The gel has yet to recover from earlier loads, by more or less than is known, or heat may have bent it: what it
  /// shows of that is not told apart from a force as small.
  kRecovering = 1U << 10,
  kGelUnverified = 1U << 11,  ///< the gel has fewer markers than verify its gel file: sensor::kVerifying
};

/// The rest pose: the place and the appearance of each marker of the unloaded gel in the picture. M is the number of
/// markers, in the order of sensor::markerPositions.
struct RestPose {
  std::vector<float> position_px;     ///< 2 M, (u, v)
  std::vector<float> amplitude;       ///< M, brightness of the marker above its surroundings [grey levels]
  std::vector<std::uint8_t> present;  ///< M, 1: seen in the rest frames
  std::vector<float> oddity;          ///< M, rms residual of the marker's template beyond the noise, as a share of the
                                      ///< amplitude; empty: not known
  float noise = 0.0F;                 ///< standard deviation of a pixel between rest frames [grey levels]
  float shotNoise = 0.0F;             ///< increase of its variance per grey level of light [grey levels]
  float light = 0.0F;                 ///< mean light at the markers' rims, to which `noise` refers [grey levels]
  /// Share of each layer's colour that is seen in the other's channel, in the order blue, red, green: of red in blue,
  /// then of blue in red. 0 if the layers do not differ in colour.
  std::array<float, 2> crossTalk{};
  std::int64_t taken_ns = 0;  ///< CLOCK_REALTIME of the last rest frame
  bool requested = false;     ///< true: a client requested it; false: taken automatically at the first start
  Id id{};                    ///< hash of all of the above
  std::string requestedBy;    ///< client that requested it, as text

  bool operator==(const RestPose&) const = default;
};

/// Displacements of all markers in one frame. Sized once, reused.
struct MarkerField {
  FrameInfo info;
  std::vector<float> displacement_px;  ///< 2 M, (u, v): right and down in the picture, from the rest pose
  std::vector<float> variance_px2;     ///< M, of each coordinate
  std::vector<std::uint8_t> valid;     ///< M, 0 or 1; if 0, the two above are 0 and have no meaning
  std::uint32_t flags = 0;
  int validCount = 0;
  int isolatedGaps = 0;  ///< markers that the zero lacks although it has at least four of their eight neighbours
  Id zero{};             ///< the rest pose from which the displacements are measured
  Id places{};  ///< the zero for whose places of the markers the forces are to be solved; all zero: those of the gel
                ///< file

  std::vector<float> elastic_px;  ///< 2 M: displacements by the forces of this moment alone, as far as that is known;
                                  ///< where valid is 0: 0; empty: not known

  // Of a gel whose creep is known (track::CreepMemory); else empty.
  /// 2 M each: what errors of the terms of creep, each by a standard deviation, do to these.
  std::vector<float> creepErrors_px;
  float creepError_px = 0.0F;  ///< root of the sum of their squares

  // Of the picture while nothing touches (calibrate::ZeroTracking).
  std::vector<float> drift_px;   ///< 2 M: what is taken off for it; where valid is 0: 0
  RestDrift drift;               ///< as it was last seen
  float heatDeviation_K = 0.0F;  ///< standard deviation of how much warmer the gel is since then

  /// Returns elastic_px, or displacement_px where that is empty.
  const std::vector<float>& byForces_px() const { return elastic_px.empty() ? displacement_px : elastic_px; }

  void resize(int markers);  ///< Sizes the arrays for M markers, and sets their elements, but nothing else, to 0.
};

/// Returns a field with room for M markers.
MarkerField blankMarkers(int markers);

}  // namespace tractiond
