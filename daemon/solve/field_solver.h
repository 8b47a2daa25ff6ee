// Interface of what computes a TractionField from a MarkerField.
#pragma once

#include "daemon/records/traction_field.h"

#include <array>

namespace tractiond::solve {

/// Thread-bound, but for answer().
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

  // A solver may be used by two threads: the one solves and learns, the other answers. An answer takes a small part of
  // the time of solve().

  /// Makes what answer() goes by, from the last solve(). Returns false if there was nothing to learn. For the thread
  /// that solves; may allocate.
  virtual bool learn() { return false; }

  /// Does what solve() does, by the newest model that was learnt, if it is young enough and this frame does not
  /// contradict it, or if nothing touches. Returns false if the field is still to be solved: then of all that it holds
  /// only the markers have a meaning. For the other thread.
  virtual bool answer(const MarkerField& markers, TractionField& field) noexcept {
    solve(markers, field);
    return true;
  }

  /// Returns whether the frame of the last answer() should be learnt, as the model that it went by grows old or holds
  /// no longer well. For the thread that answers.
  virtual bool wantsModel() const { return true; }

  /// Returns the force on a single node that is found in half of the frames: along the surface, and into it [N].
  virtual std::array<double, 2> detectionLimit_N() const = 0;
};

}  // namespace tractiond::solve
