// Makes solvers for the places of the markers that zeros show (solve/rest_places.h), while the former solver is used.
#pragma once

#include "base/background_thread.h"
#include "base/loan.h"
#include "base/mailbox.h"
#include "daemon/records/marker_field.h"
#include "daemon/solve/make_solver.h"

#include <atomic>
#include <future>
#include <memory>
#include <optional>
#include <vector>

namespace tractiond {

/// A solver, and the zero that shows the places of the markers for which it solves; all zero: those of the gel file.
struct PlacedSolver {
  std::shared_ptr<solve::FieldSolver> solver;
  Id zero{};
};

/// Bound to the control thread, except where stated. The destructor waits for a solver that is being made.
class RestSolver {
 public:
  /// \param drawn solver for the gel file's places, which the solving thread uses at first
  /// \param worker makes the solvers; outlives this
  RestSolver(sensor::Sensor sensor, const solve::SolveOptions& options, std::filesystem::path stateDirectory,
             std::shared_ptr<solve::FieldSolver> drawn, BackgroundThread& worker);
  ~RestSolver();

  /// Requests a solver for a zero that comes into force. It is made after the one that is being made; a newer zero
  /// replaces one that waits. Markers that the zero lacks, or whose place in it is not plausible, keep the place of the
  /// gel file. Must only be called if solve::followsRest() is true for the sensor. Does not wait; copies the zero;
  /// calls turn(), which may log.
  void request(const RestPose& zero);

  /// Gives up the solver that is being made, at its next step, and those that come later; does not wait. Thread-safe.
  void stop() { stopping_.store(true, std::memory_order_relaxed); }

  /// Logs the result of the solver that was made last, frees those that are no longer used, and starts on the next
  /// zero. A solver that could not be made is logged as a warning; the one before stays in use. Does not wait. Must be
  /// called in each turn of the control loop.
  void turn();

  // The newest solver goes from the thread that makes it to the tracking thread, which decides from which frame on it
  // is used, and on to the solving thread. Neither waits, allocates or frees.

  /// Sets `zero` to that of the solver for the next frame, if that is another one. While the solving thread has not
  /// taken one solver, the next one waits. For the tracking thread.
  void advanceZero(Id& zero);

  /// Replaces `solver` by that for the frames that advanceZero() has set this zero for, if it waits. For the solving
  /// thread, before each frame.
  void take(PlacedSolver& solver, const Id& zero);

  /// Returns whether no solver is being made or waits to be made, as of the last turn().
  bool idle() const { return !next_ && !making_.valid(); }

  /// Returns the number of zeros whose solver was made or could not be made. A zero that a newer one has replaced
  /// before its turn does not count. Any thread.
  std::uint64_t done() const { return done_.load(std::memory_order_acquire); }

 private:
  struct Made {
    std::shared_ptr<solve::FieldSolver> solver;
    solve::RestPlaces places;
  };
  using Result = tl::expected<Made, Error>;
  Result make(const RestPose& zero);

  const sensor::Sensor sensor_;
  const solve::SolveOptions options_;
  const std::filesystem::path stateDirectory_;
  const std::array<double, 2> detectionLimit_N_;
  BackgroundThread& worker_;
  std::atomic<bool> stopping_ = false;
  std::vector<std::shared_ptr<solve::FieldSolver>> kept_;  // all that may be in use, so that no other thread frees one
  Mailbox<PlacedSolver> ready_;                            // to the tracking thread
  Loan<PlacedSolver> handed_;                              // from the tracking to the solving thread
  std::atomic<std::uint64_t> done_ = 0;
  std::optional<RestPose> next_;
  std::future<Result> making_;
};

}  // namespace tractiond
