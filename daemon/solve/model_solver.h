// Computes a field by one statistical model of all contacts (docs/mathematics.md, section 4).
#pragma once

#include "daemon/solve/field_rules.h"
#include "daemon/solve/field_solver.h"
#include "daemon/solve/model_contacts.h"

namespace tractiond::solve {

/// Thread-bound, except for the counters.
class ModelSolver : public FieldSolver {
 public:
  /// `factors` and `atoms` must outlive the solver. \param sensor that they were computed for; need not outlive it
  /// \param detectionLimit_N result of detectionLimit_N(); without it the constructor computes it, in up to a second
  ModelSolver(const Factors& factors, const Atoms& atoms, const sensor::Sensor& sensor,
              const SolveOptions& options = {}, const std::optional<std::array<double, 2>>& detectionLimit_N = {});

  /// Implements FieldSolver::solve. Publishes forces on points beyond the nodes at the nearest node; computes resultant
  /// and moment from the points.
  void solve(const MarkerField& markers, TractionField& field) noexcept override;

  /// Returns the force from which on the model finds a contact: the median over nine nodes, each with its own noise;
  /// along the surface, and into it [N]. Infinite if it finds none of the forces that are tried, up to 16 times
  /// Factors::force_N. The constructor computed it or was given it.
  std::array<double, 2> detectionLimit_N() const override { return detectionLimit_N_; }

 private:
  void estimate(std::span<const int> missing, double noise_px);
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
  WrenchCovariance unseen_{};  ///< of forces that may act although none is found
  // Of one frame.
  UsedMarkers used_;
  std::vector<float> picture_;  ///< 2M [px]
  Estimate estimate_;
  std::vector<double> nodeForce_, nodeDeviation_;  ///< 3N
};

}  // namespace tractiond::solve
