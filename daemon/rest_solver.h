// Solvers for the places of the markers that zeros show (solve/rest_places.h), made while others are at work.
#pragma once

#include "base/mailbox.h"
#include "daemon/records/marker_field.h"
#include "daemon/solve/make_solver.h"

#include <atomic>
#include <future>
#include <memory>
#include <optional>

namespace tractiond {

/// Bound to the control thread, but for what says otherwise. The destructor waits for a solver that is being made.
class RestSolver {
 public:
  /// \param detectionLimit_N of the solver for the gel file's places
  RestSolver(sensor::Sensor sensor, const solve::SolveOptions& options, std::filesystem::path stateDirectory,
             const std::array<double, 2>& detectionLimit_N);

  /// A zero comes into force: a solver for it is made, on a thread of its own; before that, the one that is being made.
  void heed(const RestPose& zero);

  /// Does what is due: begins with the next zero, and tells the log of the last one.
  void turn();

  /// On the solving thread, before a frame: replaces `solver` by one that is ready, if there is one. Allocates and
  /// frees nothing; the replaced one is freed when the next zero's is ready.
  void take(std::shared_ptr<solve::FieldSolver>& solver) { ready_.swap(solver); }

  /// Nothing is being made or waits.
  bool idle() const { return !next_ && !making_.valid(); }

  /// Number of zeros that were heeded, and are done with. Any thread.
  std::uint64_t done() const { return done_.load(std::memory_order_acquire); }

 private:
  using Told = tl::expected<solve::RestPlaces, Error>;
  Told make(const RestPose& zero);

  const sensor::Sensor sensor_;
  const solve::SolveOptions options_;
  const std::filesystem::path stateDirectory_;
  const std::array<double, 2> detectionLimit_N_;
  Mailbox<std::shared_ptr<solve::FieldSolver>> ready_;
  std::atomic<std::uint64_t> done_ = 0;
  std::optional<RestPose> next_;
  std::future<Told> making_;
};

}  // namespace tractiond
