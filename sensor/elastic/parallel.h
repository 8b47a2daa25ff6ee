// Divides independent work among the machine's processors.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <atomic>
#include <iterator>
#include <system_error>
#include <thread>
#include <vector>

namespace sensor::elastic {

/// Calls task(i) once for each i from 0 to count - 1, on as many threads as there are processors, the calling one among
/// them, and returns when all are done; on fewer where the system gives no more. The tasks must not throw, nor write to
/// the same memory.
template <typename Task>
void inParallel(Eigen::Index count, const Task& task) {
  std::atomic<Eigen::Index> next = 0;
  const auto work = [&] {
    for (Eigen::Index i = next++; i < count; i = next++) task(i);
  };
  std::vector<std::jthread> others;
  try {
    while (std::ssize(others) + 1 < std::min<Eigen::Index>(count, std::thread::hardware_concurrency())) {
      others.emplace_back(work);
    }
  } catch (const std::system_error&) {  // no more threads
  }
  work();
}

}  // namespace sensor::elastic
