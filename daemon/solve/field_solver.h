// Interface of what computes a TractionField from a MarkerField.
#pragma once

#include "daemon/records/traction_field.h"

#include <array>

namespace tractiond::solve {

/// Thread-bound.
class FieldSolver {
 public:
  FieldSolver() = default;
  virtual ~FieldSolver() = default;
  FieldSolver(const FieldSolver&) = delete;
  FieldSolver& operator=(const FieldSolver&) = delete;

  /// Computes all of a field. Both must be sized for the sensor's markers and nodes (asserted). Copies the markers,
  /// with their FrameInfo, and their flags into the field. If too many markers are missing (sets the flag kFewMarkers),
  /// the markers have the flag kFewMarkers or kGelMismatch, or a number is not finite (sets SolverWork::failed, and no
  /// flag), the field is not valid and all its numbers but TractionField::work are 0. Allocates nothing.
  virtual void solve(const MarkerField& markers, TractionField& field) noexcept = 0;

  /// Returns the force on a single node that is found in half of the frames: along the surface, and into it [N].
  virtual std::array<double, 2> detectionLimit_N() const = 0;
};

}  // namespace tractiond::solve
