// Solves the fields of the simulation, as the daemon's solver takes a hundred times longer than the rest of a frame
// here.
#pragma once

#include "daemon/solve/field_rules.h"
#include "daemon/solve/field_solver.h"
#include "tests/simulation/gel.h"

namespace tractiond::simulation {

/// Finds whether something touches, and a force that tells of which picture it is: its normal part is the sum of the
/// squares of the displacements.
class LinearSolver : public solve::FieldSolver {
 public:
  /// The gel must outlive it.
  explicit LinearSolver(const Gel& gel);

  // Implement FieldSolver.
  void solve(const MarkerField& markers, TractionField& field) noexcept override;
  std::array<double, 2> detectionLimit_N() const override { return {}; }

 private:
  solve::UsedMarkers used_;
};

}  // namespace tractiond::simulation
