// A thread for calls that may hang.
#pragma once

#include "base/event.h"

#include <chrono>
#include <functional>
#include <memory>

namespace tractiond {

/// Does work in the order given, on a thread of its own; in the simulated world (tests/simulation) at once, and the
/// time that it takes passes later. Thread-bound: all functions are for the owner's thread.
class BackgroundThread {
 public:
  /// Starts the thread. \param name at most 15 characters \param idle signalled each time all work is done
  BackgroundThread(const char* name, std::shared_ptr<Event> idle);
  /// Does not wait: the thread finishes the work that is left, and ends. The work must not refer to the owner.
  ~BackgroundThread();
  BackgroundThread(const BackgroundThread&) = delete;
  BackgroundThread& operator=(const BackgroundThread&) = delete;

  /// Queues work and returns at once.
  void run(std::function<void()> work);
  /// Waits at most `patience`. Returns whether all the work is done.
  bool awaitIdle(std::chrono::milliseconds patience) const;

 private:
  struct State;
  std::shared_ptr<State> state_;  ///< shared with the thread
};

}  // namespace tractiond
