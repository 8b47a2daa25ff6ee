// Computes the surface forces and their uncertainty from the marker displacements.
#pragma once

#include "daemon/solve/contact_step.h"
#include "daemon/solve/contacts.h"
#include "daemon/solve/field_rules.h"
#include "daemon/solve/field_solver.h"
#include "daemon/solve/missing_markers.h"

namespace tractiond::solve {

/// Solves by ContactStep, and for all nodes where the contact is too large for it. The residual is exact within about
/// 1e-3 of the root mean square of the displacements. Thread-bound, except for the counters.
class Solver : public FieldSolver {
 public:
  /// `inverse` must outlive the solver; `sensor` is the one it was computed for and need not outlive it.
  Solver(const Inverse& inverse, const sensor::Sensor& sensor, const SolveOptions& options = {});

  // Implement FieldSolver.
  void solve(const MarkerField& markers, TractionField& field) noexcept override;
  std::array<double, 2> detectionLimit_N() const override { return contact_.detectionLimit_N(); }

 private:
  void decompose();
  void decomposeCoarsely();
  void fitWholeFace();
  void combine(double share, TractionField& field);
  void addNodes(double share, TractionField& field);
  void addNoiseOfPatch(double share, const Contacts::AtRim& found, TractionField& field) const;
  void sum(TractionField& field) const;
  void addDoubtAtRim(double share, TractionField& field) const;
  void judge(double squaredResidual, TractionField& field) const;

  const Inverse& inverse_;
  const SolveOptions options_;
  const sensor::Uncertainty uncertainty_;
  const double pitch_m_;
  const int columns_;  // of the nodes' grid
  const FieldRules rules_;
  const std::vector<std::array<double, 3>>& nodes_;  // [m]
  MissingMarkers missing_;
  ContactStep contact_;
  Contacts contacts_;
  std::vector<double> gain_;      // r + 4: s^2 / (s^2 + lambda^2), and the motion's
  std::vector<double> inverted_;  // r: gain / s [N/px]
  std::vector<int> everyMode_;    // 0 .. r-1
  CoarseMatrix coarseLeft_;       // the columns of Inverse::left that the contact step's maps need
  LineArray<float> coarseSum_;
  // Of the fit of all nodes, at 1 px of noise and at 1 N of typical force: of the wrench, and squares for each force.
  WrenchCovariance wholeNoise_{}, wholeShrinkage_{};
  std::vector<double> nodeNoise_, nodeShrinkage_;
  // Of one frame: the markers used, their noise and sum of squares; the modes' amplitudes and what they become; the
  // missing coordinates' displacements.
  UsedMarkers used_;
  double noise_px_ = 0.0;
  double squares_ = 0.0, restoredSquares_ = 0.0;
  std::vector<double> amplitudes_;
  RowMatrix filtered_;
  std::vector<double> restored_;
  std::vector<float> restoredFloat_;
  std::vector<double> forces_;
  LineArray<double> functionals_;  // the wrench of the contact step's forces, and two that stay zero
  std::vector<double> deviations_;
};

}  // namespace tractiond::solve
