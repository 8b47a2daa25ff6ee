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

/// Processors that no call of inParallel() has a thread for, besides the one that the first caller uses.
inline std::atomic<int> spareProcessors = static_cast<int>(std::max(std::thread::hardware_concurrency(), 1U)) - 1;

/// Calls task(i) once for each i from 0 to count - 1, on as many threads as there are processors, the calling one among
/// them, and returns when all are done; on fewer where other calls have them, or the system gives no more. A task may
/// call it, too. An exception of a task on the calling thread is passed on after the other threads have done the
/// remaining tasks, which are left undone if there are none; on another thread it ends the program. The tasks must not
/// write to the same memory.
template <typename Task>
void inParallel(Eigen::Index count, const Task& task) {
  std::atomic<Eigen::Index> next = 0;
  const auto work = [&] {
    for (Eigen::Index i = next++; i < count; i = next++) task(i);
  };
  std::vector<std::jthread> others;
  while (std::ssize(others) + 1 < count) {
    if (spareProcessors-- > 0) {
      try {
        others.emplace_back([&] {
          work();
          ++spareProcessors;
        });
        continue;
      } catch (const std::system_error&) {  // no more threads
      }
    }
    ++spareProcessors;
    break;
  }
  work();
}

}  // namespace sensor::elastic
