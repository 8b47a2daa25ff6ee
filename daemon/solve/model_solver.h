// Fills a field by the one statistical model of all contacts (docs/decisions/0020-one-inverse.md).
//
// Not the daemon's unless SolveOptions::solving says so.
#pragma once

#include "daemon/solve/field_rules.h"
#include "daemon/solve/field_solver.h"
#include "daemon/solve/model_contacts.h"

namespace tractiond::solve {

/// Thread-bound, but for the counters.
class ModelSolver : public FieldSolver {
 public:
  /// `factors` and `atoms` must outlive the solver; `sensor` is the one they were computed for. Takes up to a second,
  /// most of it for the detection limit if that is not given.
  ModelSolver(const Factors& factors, const Atoms& atoms, const sensor::Sensor& sensor,
              const SolveOptions& options = {}, const std::optional<std::array<double, 2>>& detectionLimit_N = {});

  /// As FieldSolver says. What acts on points beyond the nodes is published at the nearest node; resultant and moment
  /// are those of the points. Field::strength is 0: the prior has no single one.
  void solve(const MarkerField& markers, TractionField& field) noexcept override;

  /// Median over nine nodes, each with noise of its own, of the force from which on the model finds something.
  std::array<double, 2> detectionLimit_N() const override { return detectionLimit_N_; }

 private:
  void publish(TractionField& field);
  void publishForces(TractionField& field);
  void addSystematic(TractionField& field) const;
  double detectionLimit(int axis);
  Eigen::Matrix<double, 6, 6> unseen() const;

  const Factors& factors_;
  const Atoms& atoms_;
  const sensor::Uncertainty uncertainty_;
  const double noise_px_;  ///< as calibrated
  const FieldRules rules_;
  const Eigen::Vector4d motion_;  ///< standard deviations of its prior
  Model model_;
  ModelContacts contacts_;
  std::array<double, 2> detectionLimit_N_{};
  WrenchCovariance unseen_{};  ///< of what may act where nothing is found
  // Of one frame.
  UsedMarkers used_;
  std::vector<float> picture_;  ///< 2M [px]
  Estimate estimate_;
  std::vector<double> nodeForce_, nodeDeviation_;  ///< 3N
};

}  // namespace tractiond::solve
