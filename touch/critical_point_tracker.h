// Follows critical points from field to field, as contacts are: each has an id for as long as it lasts.
//
//   1. A point continues an earlier one of the same index that was last seen at most kReach_m from there. Of all ways
//      to pair them, that with the least sum of squared distances is taken. Its kind may change: a vortex becomes a
//      sink.
//   2. One that a field does not show, or of which the field says nothing as it is not valid, has its id again if it is
//      seen within `memory_s`.
//   3. All are new where fields cannot be compared: time did not advance, or the basis changed.
// Those that a field shows are listed, and no others: a point that is missing has ended, or is too weak. Ids increase
// from 1 and are not used again.
#pragma once

#include "touch/critical_points.h"
#include "touch/field.h"

#include <cstdint>
#include <vector>

namespace touch {

/// Thread-bound.
class CriticalPointTracker {
 public:
  static constexpr double kReach_m = 6e-3;

  /// Takes what the next field shows.
  /// \param field says when it was, whether it is valid, and its basis
  /// \param points of it, without ids and times of begin
  /// \param memory_s as ContactTracker::memory_s()
  /// \returns the points with these, by increasing id; valid until the next call
  const std::vector<CriticalPoint>& update(const Field& field, const std::vector<CriticalPoint>& points,
                                           double memory_s);

 private:
  struct Track {
    CriticalPoint point;
    std::int64_t seen_ns = 0;
  };

  std::vector<Track> tracks_;  ///< by increasing id
  std::vector<CriticalPoint> seen_;
  Basis basis_;
  std::int64_t last_ns_ = 0;  ///< time of the last valid field
  std::uint64_t lastId_ = 0;
};

}  // namespace touch
