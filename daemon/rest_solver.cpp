#include "daemon/rest_solver.h"

#include <pthread.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>

#include <chrono>
#include <thread>
#include <utility>

namespace tractiond {

RestSolver::RestSolver(sensor::Sensor sensor, const solve::SolveOptions& options, std::filesystem::path stateDirectory,
                       const std::array<double, 2>& detectionLimit_N)
    : sensor_(std::move(sensor))
    , options_(options)
    , stateDirectory_(std::move(stateDirectory))
    , detectionLimit_N_(detectionLimit_N) {}

void RestSolver::heed(const RestPose& zero) {
  next_ = zero;
  turn();
}

void RestSolver::turn() {
  if (making_.valid()) {
    if (making_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
    const Told told = making_.get();
    if (!told) {
      spdlog::warn("warning: the markers' places in the zero are not used, but those of the gel file: {}",
                   told.error().message());
    } else {
      spdlog::info("the model takes the places of {} markers from the zero, {:.3f} mm (rms) beside those of the gel "
                   "file; {} are missing and {} too far away, for which it takes those of the gel file",
                   told->measured, 1e3 * told->rms_m, told->missing, told->implausible);
    }
  }
  if (!next_) return;
  making_ = std::async(std::launch::async, [this, zero = *std::exchange(next_, std::nullopt)] {
    constexpr int kNice = 10;  // of this thread alone: frames are in more of a hurry
    setpriority(PRIO_PROCESS, 0, kNice);
    pthread_setname_np(pthread_self(), "tr-places");
    return make(zero);
  });
}

RestSolver::Told RestSolver::make(const RestPose& zero) {
  auto made =
      solve::makeSolverAtRest(sensor_, options_, stateDirectory_, zero.position_px, zero.present, detectionLimit_N_,
                              [](const std::string& remark) { spdlog::warn("warning: {}", remark); });
  if (made) {
    const std::shared_ptr<solve::FieldSolver> solver = std::move(made->solver);
    while (!ready_.put(solver)) std::this_thread::yield();  // just being taken: some instructions
  }
  done_.fetch_add(1, std::memory_order_release);
  return made.map([](const solve::SolverAtRest& at) { return at.places; });
}

}  // namespace tractiond
