// Makes solvers for the places of the markers that zeros show (solve/rest_places.h), while the former solver is used.
#pragma once

#include "base/background_thread.h"
#include "base/mailbox.h"
#include "daemon/records/marker_field.h"
#include "daemon/solve/make_solver.h"

#include <atomic>
#include <future>
#include <memory>
#include <optional>

namespace tractiond {

/// A solver, and the zero that shows the places of the markers for which it solves; all zero: those of the gel file.
struct PlacedSolver {
  std::shared_ptr<solve::FieldSolver> solver;
  Id zero{};
};

/// Bound to the control thread, except where stated. The destructor waits for a solver that is being made.
class RestSolver {
 public:
  /// \param detectionLimit_N of the solver for the gel file's places
  /// \param worker makes the solvers; outlives this
  RestSolver(sensor::Sensor sensor, const solve::SolveOptions& options, std::filesystem::path stateDirectory,
             const std::array<double, 2>& detectionLimit_N, BackgroundThread& worker);
  ~RestSolver();

  /// Requests a solver for a zero that comes into force. It is made after the one that is being made; a newer zero
  /// replaces one that waits. Markers that the zero lacks, or whose place in it is not plausible, keep the place of the
  /// gel file. Must only be called if solve::followsRest() is true for the sensor. Does not wait; copies the zero;
  /// calls turn(), which may log.
  void heed(const RestPose& zero);

  /// Gives up the solver that is being made, at its next step, and those that come later; does not wait. Thread-safe.
  void stop() { stopping_.store(true, std::memory_order_relaxed); }

  /// Logs the result of the solver that was made last, starts on the next zero, or frees the solver that take() has
  /// replaced. A solver that could not be made is logged as a warning; the one before stays in use. Does not wait. Must
  /// be called in each turn of the control loop.
  void turn();

  /// Replaces `zero` by that of the newest solver that is ready, if there is a new one. For the tracking thread, which
  /// thus decides from which frame on it is used.
  void see(Id& zero) { seen_.take(zero); }

  /// Replaces `solver` by the newest one that is ready, if there is a new one. For the solving thread, before the first
  /// frame for which see() returned its zero. Allocates and frees nothing: turn() frees the replaced solver.
  void take(PlacedSolver& solver) { ready_.swap(solver); }

  /// Returns whether no solver is being made or waits to be made, as of the last turn().
  bool idle() const { return !next_ && !making_.valid(); }

  /// Returns the number of zeros whose solver was made or could not be made. A zero that a newer one has replaced
  /// before its turn does not count. Any thread.
  std::uint64_t done() const { return done_.load(std::memory_order_acquire); }

 private:
  using Told = tl::expected<solve::RestPlaces, Error>;
  Told make(const RestPose& zero);

  const sensor::Sensor sensor_;
  const solve::SolveOptions options_;
  const std::filesystem::path stateDirectory_;
  const std::array<double, 2> detectionLimit_N_;
  BackgroundThread& worker_;
  std::atomic<bool> stopping_ = false;
  Mailbox<PlacedSolver> ready_;
  Mailbox<Id> seen_;
  std::atomic<std::uint64_t> done_ = 0;
  std::optional<RestPose> next_;
  std::future<Told> making_;
};

}  // namespace tractiond
