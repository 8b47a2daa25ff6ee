// Divides independent work among the machine's processors.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

namespace sensor::elastic {

/// Calls task(i) once for each i from 0 to count - 1, on as many threads as there are processors, the calling one among
/// them, and returns when all are done. The tasks must not write to the same memory; those of other threads must not
/// throw. After an exception on the calling thread, which is passed on, no more tasks begin.
template <typename Task>
void inParallel(Eigen::Index count, const Task& task) {
  std::atomic<Eigen::Index> next = 0;
  const auto work = [&] {
    for (Eigen::Index i = next++; i < count; i = next++) task(i);
  };
  std::vector<std::jthread> others;
  for (Eigen::Index i = 1; i < std::min<Eigen::Index>(count, std::thread::hardware_concurrency()); ++i) {
    others.emplace_back(work);
  }
  try {
    work();
  } catch (...) {
    next = count;
    throw;
  }
}

}  // namespace sensor::elastic
