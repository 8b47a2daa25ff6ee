// Marker displacements in, surface forces out.
#pragma once

#include "daemon/records/ledger.h"
#include "daemon/records/traction_field.h"
#include "daemon/solve/missing_markers.h"

namespace tractiond::solve {

/// Thread-bound, but for the counters.
class Solver {
 public:
  /// `inverse` must outlive the solver; `nodes` are those it was computed for.
  Solver(const Inverse& inverse, const sensor::NodeGrid& nodes, const SolveOptions& options = {});

  /// Fills a field that is sized for the markers and nodes, but for its times. Where too many markers are missing
  /// (flag kFewMarkers) or a number is not finite, the field is not valid and all its numbers are 0. The residual is
  /// exact within about 1e-3 of the displacements' root mean square. Allocates nothing.
  void solve(const MarkerField& markers, TractionField& field) noexcept;

  /// Fields that were not valid, by cause. Any thread may read them.
  struct Counters {
    Counter fewMarkers;
    Counter notFinite;
  };
  const Counters& counters() const { return counters_; }

 private:
  bool fit(const MarkerField& markers, double& residual_px);
  bool sum(TractionField& field) const;

  const Inverse& inverse_;
  const SolveOptions options_;
  std::vector<std::array<double, 2>> nodes_;  // x, y [m]
  MissingMarkers missing_;
  std::vector<double> gain_;      // r: s^2 / (s^2 + lambda^2)
  std::vector<double> inverted_;  // r: gain / s [N/px]
  std::vector<int> everyMode_;    // 0 .. r-1
  // Scratch: the valid coordinates and their displacements; the modes' amplitudes and what they become; what the
  // missing coordinates would show; the forces.
  std::vector<int> coordinates_;
  std::vector<float> displacements_;
  std::vector<double> amplitudes_;
  RowMatrix filtered_;
  std::vector<double> restored_;
  std::vector<float> restoredFloat_;
  std::vector<double> forces_;
  Counters counters_;
};

}  // namespace tractiond::solve
