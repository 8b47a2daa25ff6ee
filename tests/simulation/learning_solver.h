// Answers by models of earlier frames, as the daemon's solver does: a frame by one that is in force, if its picture is
// the model's but for noise.
#pragma once

#include "base/mailbox.h"
#include "tests/simulation/linear_solver.h"

#include <functional>

namespace tractiond::simulation {

/// A model is the frame that it was made of. What it answers is what LinearSolver finds.
class LearningSolver : public solve::FieldSolver {
 public:
  /// The gel must outlive it.
  /// \param work lets the time pass that a solution takes, or a model
  LearningSolver(const Gel& gel, std::function<void()> work);

  // Implement FieldSolver. answer() completes the field also where it returns false: who takes it breaks a law.
  void solve(const MarkerField& markers, TractionField& field) noexcept override;
  bool learn() override;
  bool answer(const MarkerField& markers, TractionField& field) noexcept override;
  bool wantsModel() const override { return wantsModel_; }
  std::array<double, 2> detectionLimit_N() const override { return {}; }

 private:
  LinearSolver linear_;  // of both threads: no time passes in it
  const std::function<void()> work_;
  MarkerField solved_;  ///< the last one that can be learnt
  bool canLearn_ = false;
  Mailbox<MarkerField> newest_;
  // Of answer().
  MarkerField model_;
  bool wantsModel_ = true;
};

}  // namespace tractiond::simulation
