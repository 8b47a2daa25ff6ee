// Computes a field by one statistical model of all contacts (docs/mathematics.md, section 4), and answers by the model
// of an earlier frame.
#pragma once

#include "base/mailbox.h"
#include "daemon/solve/field_solver.h"
#include "daemon/solve/field_writer.h"
#include "daemon/solve/linear_model.h"
#include "daemon/solve/model_frame.h"

#include <array>
#include <memory>
#include <optional>
#include <vector>

namespace tractiond::solve {

class ModelSolver : public FieldSolver {
 public:
  /// `factors` and `atoms` must outlive the solver.
  /// \param sensor that they were computed for; need not outlive it
  /// \param detectionLimit_N result of detectionLimit_N(); without it the constructor computes it
  ModelSolver(const Factors& factors, const Atoms& atoms, const sensor::Sensor& sensor,
              const SolveOptions& options = {}, const std::optional<std::array<double, 2>>& detectionLimit_N = {});

  /// Implements FieldSolver::solve. Publishes forces on points beyond the nodes at the nearest node; computes resultant
  /// and moment from the points.
  void solve(const MarkerField& markers, TractionField& field) noexcept override;
  bool learn() override;
  bool answer(const MarkerField& markers, TractionField& field) noexcept override;
  bool wantsModel() const override { return wantsModel_; }

  /// Returns the force from which on the model finds a contact: the median over nine nodes, each with its own noise;
  /// along the surface, and into it [N]. Infinite if it finds none of the forces that are tried, up to 16 times
  /// Factors::force_N. The constructor computed it or was given it.
  std::array<double, 2> detectionLimit_N() const override { return detectionLimit_N_; }

 private:
  struct Learnt {
    LinearModel model;
    ModelFrame of;
  };

  std::array<double, 2> detectionLimits(const sensor::Sensor& sensor);
  double detectionLimit(int axis, double error);
  void answerNothing(const Displacements& picture, TractionField& field);

  const Factors& factors_;
  const Atoms& atoms_;
  const double noise_px_;  ///< as calibrated
  Model model_;
  Modes modes_;                                   ///< of answer()
  const std::array<double, 2> detectionLimit_N_;  ///< found with the two above
  // Of solve() and learn().
  Estimate estimate_;
  FieldWriter writer_;
  ModelFrame solved_;                            ///< frame of the last solve()
  std::vector<std::shared_ptr<Learnt>> learnt_;  ///< all that exist; the holder of the only copy may fill it
  LinearScratch scratch_;
  Mailbox<std::shared_ptr<Learnt>> newest_;
  // Of answer().
  std::shared_ptr<Learnt> inForce_;
  bool wantsModel_ = true;
  FieldWriter answerWriter_;
  Estimate answer_;
  AtomProducts noProducts_;  ///< of no atoms: those of the motion alone
  Posterior motionAlone_;
  Mixture empty_;
};

}  // namespace tractiond::solve
