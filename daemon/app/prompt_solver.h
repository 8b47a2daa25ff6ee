// Solves each frame in time. The solving thread answers a frame by the newest model; another thread solves the newest
// frame and makes the next model of it. What the model cannot answer is solved by the other thread while this one
// waits, up to a limit.
#pragma once

#include "base/event.h"
#include "base/mailbox.h"
#include "daemon/records/traction_field.h"
#include "daemon/solve/field_solver.h"

#include <atomic>
#include <chrono>
#include <limits>
#include <memory>

namespace tractiond {

struct PromptOptions {
  double patience_ms = 0.0;  ///< longest time that a frame waits for its solution; 0: one frame interval
  double models_Hz = 0.0;    ///< most models that are made in a second; 0: as many as are wanted
};

/// The interval between neighbouring frames, also where frames between two that are seen were evicted or lost: one that
/// waited must not lengthen the wait of the next.
class FrameInterval {
 public:
  std::chrono::nanoseconds next(const FrameInfo& frame);

 private:
  std::uint64_t number_ = 0;
  std::int64_t received_ns_ = 0;
};

/// The two threads neither lock nor wait for each other, except as solve() says.
class PromptSolver {
 public:
  /// \param markers,
  /// \param nodes numbers of them in the records
  PromptSolver(const PromptOptions& options, int markers, int nodes);

  /// Computes the field of a frame. If the newest model does not hold for it, waits for its own solution; if that takes
  /// too long, the field is not valid and has the flag kNotSolved. For the solving thread. Allocates nothing.
  /// \param solver must also be held by the caller, or by its owner, as long as there is a copy of the pointer here: it
  /// is never freed on this thread
  void solve(const std::shared_ptr<solve::FieldSolver>& solver, const MarkerField& markers, TractionField& field);

  /// Waits at most `timeout` for a frame, solves it and makes a model. For the thread that makes models.
  void turn(std::chrono::milliseconds timeout);

 private:
  struct Offer {
    std::shared_ptr<solve::FieldSolver> solver;
    MarkerField markers;
    bool isWaitedFor = false;
  };

  std::chrono::nanoseconds patience(const FrameInfo& frame);
  bool take();

  const PromptOptions options_;
  Mailbox<Offer> offers_;             // to the other thread
  Mailbox<TractionField> solutions_;  // from it
  Event offered_, solved_;
  std::atomic<std::uint64_t> waitsFor_{0};  // number of the frame; 0: none
  // Of the solving thread.
  Offer offer_;
  TractionField solution_;
  FrameInterval interval_;
  // Of the other thread.
  Offer taken_;
  TractionField field_;
  std::int64_t made_ns_ = std::numeric_limits<std::int64_t>::min() / 2;  // when the last model was made
};

}  // namespace tractiond
