// Solves the fields of the simulation: by least squares for all nodes, as the model of the daemon takes a hundred times
// longer than the rest of a frame here. What is valid, and what flags say, is by the same rules (solve/field_rules.h).
#pragma once

#include "daemon/solve/field_rules.h"
#include "daemon/solve/field_solver.h"
#include "tests/simulation/gel.h"

namespace tractiond::simulation {

/// Takes the displacements of missing markers for 0. Finds no contact where the picture shows noise alone. Has no
/// contacts and no systematic errors.
class LinearSolver : public solve::FieldSolver {
 public:
  /// The gel must outlive it.
  explicit LinearSolver(const Gel& gel);

  // Implement FieldSolver.
  void solve(const MarkerField& markers, TractionField& field) noexcept override;
  std::array<double, 2> detectionLimit_N() const override { return {}; }

 private:
  const Gel& gel_;
  const solve::FieldRules rules_;
  solve::UsedMarkers used_;
  Eigen::VectorXf displacement_px_, force_N_, residual_px_;
};

}  // namespace tractiond::simulation
