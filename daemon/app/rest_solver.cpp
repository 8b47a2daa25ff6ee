#include "daemon/app/rest_solver.h"

#include <spdlog/spdlog.h>

#include <chrono>
#include <thread>
#include <utility>

namespace tractiond {

RestSolver::RestSolver(sensor::Sensor sensor, const solve::SolveOptions& options, std::filesystem::path stateDirectory,
                       std::shared_ptr<solve::FieldSolver> drawn, BackgroundThread& worker)
    : sensor_(std::move(sensor))
    , options_(options)
    , stateDirectory_(std::move(stateDirectory))
    , detectionLimit_N_(drawn->detectionLimit_N())
    , worker_(worker)
    , kept_{std::move(drawn)} {}

RestSolver::~RestSolver() {
  stop();
  if (making_.valid()) making_.wait();
}

void RestSolver::request(const RestPose& zero) {
  next_ = zero;
  turn();
}

void RestSolver::turn() {
  if (making_.valid()) {
    if (making_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
    Result result = making_.get();
    if (!result) {
      spdlog::warn("warning: the markers' places in the zero are not used, but those that were in use before: {}",
                   result.error().message());
    } else {
      spdlog::info("the model takes the places of {} markers from the zero, {:.3f} mm (rms) beside those of the gel "
                   "file; {} are missing and {} too far away, for which it takes those of the gel file",
                   result->places.measured, 1e3 * result->places.rms_m, result->places.missing,
                   result->places.implausible);
      kept_.push_back(std::move(result->solver));
    }
  }
  // Frees each solver whose only copy is here: no other thread can copy it any more.
  std::erase_if(kept_, [](const auto& solver) { return solver.use_count() == 1; });
  if (!next_) return;
  making_ = worker_.start([this, zero = *std::exchange(next_, std::nullopt)] { return make(zero); });
}

RestSolver::Result RestSolver::make(const RestPose& zero) {
  auto made = solve::makeSolverAtRest(
      sensor_, options_, stateDirectory_, zero.position_px, zero.present, detectionLimit_N_,
      [](const std::string& remark) { spdlog::warn("warning: {}", remark); },
      [this] { return stopping_.load(std::memory_order_relaxed); });
  Result result = made.map([](solve::SolverAtRest& at) { return Made{std::move(at.solver), at.places}; });
  if (result) {
    const PlacedSolver placed{result->solver, zero.id};
    while (!ready_.put(placed)) std::this_thread::yield();  // the other thread is taking it: some instructions
  }
  done_.fetch_add(1, std::memory_order_release);
  return result;
}

void RestSolver::advanceZero(Id& zero) {
  PlacedSolver* const next = handed_.own();
  if (next == nullptr || !ready_.swap(*next)) return;
  zero = next->zero;
  handed_.lend();
}

void RestSolver::take(PlacedSolver& solver, const Id& zero) {
  PlacedSolver* const next = handed_.lent();
  if (next == nullptr || next->zero != zero) return;  // frames from before are still on their way
  solver = std::exchange(*next, {});
  handed_.giveBack();
}

}  // namespace tractiond
