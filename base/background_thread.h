// A thread for calls that may hang.
#pragma once

#include "base/event.h"

#include <chrono>
#include <functional>
#include <future>
#include <memory>
#include <type_traits>
#include <utility>

namespace tractiond {

/// Does work in the order given, on a thread of its own. In the simulated world (tests/simulation) run() does the work
/// at once, the time that it takes passes later, and `idle` is not signalled. Thread-bound: all functions are for the
/// owner's thread.
class BackgroundThread {
 public:
  /// Starts the thread.
  /// \param name at most 15 characters, of static storage: the thread reads it when it starts
  /// \param idle null: none; otherwise signalled, by the thread, each time all the work is done
  /// \throws std::system_error if no thread can be started
  explicit BackgroundThread(const char* name, std::shared_ptr<Event> idle = {});
  /// Does not wait: the thread finishes the work that is left, unless the process ends before, and ends. Work that may
  /// be left then must not refer to what is destroyed with the owner: see awaitIdle().
  ~BackgroundThread();
  BackgroundThread(const BackgroundThread&) = delete;
  BackgroundThread& operator=(const BackgroundThread&) = delete;

  /// Queues work and returns at once. The queue has no limit. An exception that leaves `work` ends the process.
  void run(std::function<void()> work);
  /// As run(). Returns a future of what `work` returns or throws; its destructor does not wait. The future may be ready
  /// before `work` itself is destroyed: awaitIdle() waits for that, too.
  template <typename Work>
  auto start(Work work) {
    auto task = std::make_shared<std::packaged_task<std::invoke_result_t<Work&>()>>(std::move(work));
    auto result = task->get_future();
    run([task = std::move(task)] { (*task)(); });
    return result;
  }
  /// Waits at most `patience`, which may be 0, until all the work is done. Returns whether it is; true without work.
  bool awaitIdle(std::chrono::milliseconds patience) const;
  /// Waits until all the work is done.
  void awaitIdle() const {
    while (!awaitIdle(std::chrono::hours(1))) continue;
  }

 private:
  struct State;
  std::shared_ptr<State> state_;  ///< shared with the thread
};

}  // namespace tractiond
