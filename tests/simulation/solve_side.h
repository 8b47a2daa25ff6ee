// PromptSolver of a life, with the thread that makes its models, above the simulated solver; and the laws of what it
// makes of a frame.
#pragma once

#include "daemon/app/prompt_solver.h"
#include "tests/simulation/fiber.h"
#include "tests/simulation/journal.h"
#include "tests/simulation/learning_solver.h"
#include "tests/simulation/ongoing.h"

#include <memory>

namespace tractiond::simulation {

/// What has to do with the thread that makes models (tr-model), in all lives of a run.
struct Modelling {
  Chance chance;          ///< of its own, so that stories from before it draw the numbers that they drew
  Starvation starvation;  ///< of that thread alone
};

class SolveSide {
 public:
  /// All references must outlive it.
  SolveSide(const Gel& gel, const PromptOptions& options, Modelling& modelling, const Starvation& starvation,
            const Ongoing& ongoing, Journal& journal);

  /// Solves a frame, on a fiber. Laws: it is this frame's field, with the numbers that the solver finds for this frame
  /// alone, or not solved, and says so; and it waits for its solution no longer than for its patience, and not in vain
  /// if models are made fast.
  void solve(const MarkerField& markers, TractionField& field);

  /// Takes a turn of tr-model, or goes on with the one that waits.
  void modelTurn() { modelThread_.go(); }
  /// Returns when that has something to do.
  std::int64_t modelWakes_ns() const { return modelThread_.wakes_ns(); }
  /// Ends tr-model with its turn.
  void stop();

  /// Returns when a frame waited for its solution last.
  std::int64_t waited_ns() const { return waited_ns_; }

 private:
  void work();
  std::int64_t patience_ns(const FrameInfo& info);
  void checkWait(const TractionField& field, std::int64_t patience_ns, std::int64_t lasted_ns) const;
  void checkNumbers(const MarkerField& markers, const TractionField& field);

  const PromptOptions options_;
  Modelling& modelling_;
  const Starvation& starvation_;
  const Ongoing& ongoing_;
  Journal& journal_;
  LinearSolver judge_;
  TractionField expected_;
  const std::shared_ptr<LearningSolver> solver_;
  PromptSolver prompt_;
  std::int64_t last_ns_ = 0;  ///< when the frame before was received
  std::int64_t waited_ns_ = 0;
  bool hasStopped_ = false;
  Fiber modelThread_;
};

}  // namespace tractiond::simulation
