// Work on a thread of its own: it takes effect at once, and ends when the disk has taken its time.
#pragma once

#include "tests/simulation/disk.h"

#include <deque>
#include <functional>
#include <future>
#include <utility>

namespace tractiond::simulation {

template <typename T>
class Later {
 public:
  struct Piece {
    T outcome;
    std::int64_t at_ns = 0;  ///< when it ends
    std::promise<T> done = {};
  };

  /// The disk must outlive it.
  explicit Later(Disk& disk)
      : disk_(disk) {}

  /// Does the work. The future is ready when turn() is called after its end.
  std::future<T> begin(const std::function<T()>& work) {
    disk_.beginWork();
    T outcome = work();
    pieces_.push_back({std::move(outcome), disk_.endWork()});
    return pieces_.back().done.get_future();
  }
  const Piece& newest() const { return pieces_.back(); }

  /// Ends what is due, after `visit` has seen its outcome.
  void turn(const std::function<void(const T&)>& visit = [](const T&) {}) {
    for (; !pieces_.empty() && pieces_.front().at_ns <= now(); pieces_.pop_front()) {
      visit(pieces_.front().outcome);
      pieces_.front().done.set_value(std::move(pieces_.front().outcome));
    }
  }
  /// Returns when turn() has something to do; kNever: it has not.
  std::int64_t next_ns() const { return pieces_.empty() ? kNever : pieces_.front().at_ns; }
  bool isIdle() const { return pieces_.empty(); }
  /// Returns when all work has ended.
  std::int64_t idle_ns() const { return pieces_.empty() ? now() : pieces_.back().at_ns; }
  /// Drops all work, as the daemon was killed; its futures are broken.
  void die() { pieces_.clear(); }

 private:
  Disk& disk_;
  std::deque<Piece> pieces_;
};

}  // namespace tractiond::simulation
