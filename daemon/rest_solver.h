// Solvers for the places of the markers that zeros show (solve/rest_places.h), made on a background thread.
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

/// Bound to the control thread, except for functions that state another. The destructor waits for the step at which a
/// solver that is being made can be given up.
class RestSolver {
 public:
  /// \param detectionLimit_N of the solver for the gel file's places
  /// \param worker makes the solvers; outlives this
  RestSolver(sensor::Sensor sensor, const solve::SolveOptions& options, std::filesystem::path stateDirectory,
             const std::array<double, 2>& detectionLimit_N, BackgroundThread& worker);
  ~RestSolver();

  /// Makes a solver for a zero that comes into force, when the one that is being made is done.
  void heed(const RestPose& zero);

  /// Gives up the solver that is being made, at its next step, and those that come later. Thread-safe.
  void stop() { stopping_.store(true, std::memory_order_relaxed); }

  /// Does what is due: begins with the next zero, and logs the result of the last one.
  void turn();

  /// Replaces `solver` by one that is ready, if there is one. For the solving thread, before a frame. Allocates and
  /// frees nothing; the replaced one is freed when the next zero's is ready.
  void take(std::shared_ptr<solve::FieldSolver>& solver) { ready_.swap(solver); }

  /// Returns whether nothing is being made or waits.
  bool idle() const { return !next_ && !making_.valid(); }

  /// Returns the number of zeros whose solvers are done. Any thread.
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
  Mailbox<std::shared_ptr<solve::FieldSolver>> ready_;
  std::atomic<std::uint64_t> done_ = 0;
  std::optional<RestPose> next_;
  std::future<Told> making_;
};

}  // namespace tractiond
