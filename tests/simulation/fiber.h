// A thread of the daemon that may stop in the middle of a turn, where it waits, while simulated time goes on.
#pragma once

#include "tests/simulation/world.h"

#include <ucontext.h>

#include <cstddef>
#include <exception>
#include <functional>
#include <memory>

namespace tractiond::simulation {

/// Runs on a stack of its own, in the thread that calls go(): only one of all runs at a time, and which one is decided
/// by who calls.
class Fiber {
 public:
  /// \param turn what it does in a turn
  explicit Fiber(std::function<void()> turn);
  ~Fiber();  ///< Calls end(); what the turn throws is lost.
  Fiber(const Fiber&) = delete;
  Fiber& operator=(const Fiber&) = delete;

  /// Begins a turn, or goes on with the one that waits. Returns whether it is over. Throws what the turn throws.
  bool go();
  /// Ends the turn that waits, if one does. From now on waits are over at once, after which the daemon's clocks show
  /// the time until the turn ends at which they would have been over (Clocks::hurried_ns).
  void end();
  /// Returns whether a turn waits.
  bool waits() const { return isInTurn_; }
  /// Returns when go() has something to do.
  std::int64_t wakes_ns() const { return !isInTurn_ || isOver_() ? now() : until_ns_; }

  /// Has the fiber that runs wait until a time of the daemon's clock, or until `isOver` returns true, which is asked
  /// when something has happened. Returns at once if none runs.
  static void wait(std::int64_t until_ns, std::function<bool()> isOver);
  static void sleep(std::int64_t for_ns);

 private:
  static void run();
  void enter();
  void leave();

  const std::function<void()> turn_;
  const std::unique_ptr<std::byte[]> stack_;
  ucontext_t caller_{}, own_{};
  void *callersFake_ = nullptr, *ownFake_ = nullptr;  // of the sanitizer
  const void* callersStack_ = nullptr;
  std::size_t callersSize_ = 0;
  std::exception_ptr thrown_;
  std::function<bool()> isOver_;
  std::int64_t until_ns_ = 0;
  bool isInTurn_ = false, hurries_ = false;
};

}  // namespace tractiond::simulation
