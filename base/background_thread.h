// A thread for calls that may hang.
#pragma once

#include "base/event.h"

#include <chrono>
#include <functional>
#include <memory>

namespace tractiond {

/// Does work in the order given, on a thread of its own; in the simulated world (tests/simulation) at once, and the
/// time that it takes passes later. Thread-bound: all from the owner's thread.
class BackgroundThread {
 public:
  /// Starts the thread. The name has at most 15 characters. `idle` is signalled each time all the work is done.
  BackgroundThread(const char* name, std::shared_ptr<Event> idle);
  /// Does not wait: the thread does the work that is left, and ends.
  ~BackgroundThread();
  BackgroundThread(const BackgroundThread&) = delete;
  BackgroundThread& operator=(const BackgroundThread&) = delete;

  void run(std::function<void()> work);
  /// Waits at most `patience`. Returns whether all the work is done.
  bool awaitIdle(std::chrono::milliseconds patience) const;

 private:
  struct State;
  std::shared_ptr<State> state_;  ///< shared with the thread
};

}  // namespace tractiond
