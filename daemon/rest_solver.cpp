#include "daemon/rest_solver.h"

#include <spdlog/spdlog.h>

#include <chrono>
#include <thread>
#include <utility>

namespace tractiond {

RestSolver::RestSolver(sensor::Sensor sensor, const solve::SolveOptions& options, std::filesystem::path stateDirectory,
                       const std::array<double, 2>& detectionLimit_N, BackgroundThread& worker)
    : sensor_(std::move(sensor))
    , options_(options)
    , stateDirectory_(std::move(stateDirectory))
    , detectionLimit_N_(detectionLimit_N)
    , worker_(worker) {}

RestSolver::~RestSolver() {
  stop();
  if (making_.valid()) making_.wait();
}

void RestSolver::heed(const RestPose& zero) {
  next_ = zero;
  turn();
}

void RestSolver::turn() {
  if (making_.valid()) {
    if (making_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
    const Told told = making_.get();
    if (!told) {
      spdlog::warn("warning: the markers' places in the zero are not used, but those that were in use before: {}",
                   told.error().message());
    } else {
      spdlog::info("the model takes the places of {} markers from the zero, {:.3f} mm (rms) beside those of the gel "
                   "file; {} are missing and {} too far away, for which it takes those of the gel file",
                   told->measured, 1e3 * told->rms_m, told->missing, told->implausible);
    }
  }
  if (!next_) {
    ready_.clear();
    return;
  }
  making_ = worker_.start([this, zero = *std::exchange(next_, std::nullopt)] { return make(zero); });
}

RestSolver::Told RestSolver::make(const RestPose& zero) {
  auto made = solve::makeSolverAtRest(
      sensor_, options_, stateDirectory_, zero.position_px, zero.present, detectionLimit_N_,
      [](const std::string& remark) { spdlog::warn("warning: {}", remark); },
      [this] { return stopping_.load(std::memory_order_relaxed); });
  if (made) {
    const PlacedSolver placed{std::move(made->solver), zero.id};
    while (!ready_.put(placed)) std::this_thread::yield();  // the other thread is taking it: some instructions
    while (!seen_.put(zero.id)) std::this_thread::yield();
  }
  done_.fetch_add(1, std::memory_order_release);
  return made.map([](const solve::SolverAtRest& at) { return at.places; });
}

}  // namespace tractiond
