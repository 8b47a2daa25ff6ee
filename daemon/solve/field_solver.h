// What fills a TractionField, whatever it solves with.
#pragma once

#include "daemon/records/ledger.h"
#include "daemon/records/traction_field.h"

#include <array>

namespace tractiond::solve {

/// Thread-bound, but for the counters.
class FieldSolver {
 public:
  FieldSolver() = default;
  virtual ~FieldSolver() = default;
  FieldSolver(const FieldSolver&) = delete;
  FieldSolver& operator=(const FieldSolver&) = delete;

  /// Fills a field that is sized for the markers and nodes, but for its times. Where too many markers are missing
  /// (flag kFewMarkers) or a number is not finite, the field is not valid and all its numbers are 0. Allocates nothing.
  virtual void solve(const MarkerField& markers, TractionField& field) noexcept = 0;

  /// Force that is found in half of the frames when a node carries it: along the surface, and into it [N].
  virtual std::array<double, 2> detectionLimit_N() const = 0;

  /// Fields by what became of them. Any thread may read them.
  struct Counters {
    Counter fewMarkers;  ///< not valid
    Counter notFinite;   ///< not valid
    Counter wholeFace;   ///< the contact step fell back, wholly or in part
  };
  const Counters& counters() const { return counters_; }

 protected:
  Counters counters_;
};

}  // namespace tractiond::solve
