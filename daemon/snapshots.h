// Copies of single frames for the control thread: for whoever asks for a snapshot, and for the daemon's own looks.
#pragma once

#include "base/clock.h"
#include "base/loan.h"
#include "daemon/records/snapshot.h"

#include <tl/expected.hpp>

#include <functional>
#include <string>

namespace tractiond {

/// The record and who waits for it. Bound to the control thread, but for lent() and giveBack().
class Snapshots {
 public:
  using Result = tl::expected<const Snapshot*, std::string>;

  /// \param answer          called in take() or turn() for what was asked with ask(): the copy, or why there is none
  /// \param longestWait_s   for a frame, when a snapshot is asked for
  explicit Snapshots(std::function<void(const Result&)> answer, double longestWait_s = 3.0,
                     std::int64_t (*clock)() = monotonicNow);

  /// Room for what travels with the copies; before the first turn.
  Snapshot& room() { return *loan_.own(); }

  /// Notes that somebody wants to see the next frame.
  void ask() { askedAt_ns_ = clock_(); }

  /// Returns the copy that has been made since the last call, and answers whoever asked; null: there is none.
  const Snapshot* take();

  /// Wants a copy of the next frame if somebody asked or `isWanted`; refuses whoever has waited too long.
  void turn(bool isWanted = false);

  // The tracking thread's.

  /// Returns the room for a copy of the frame; null: none is wanted.
  Snapshot* lent() { return loan_.lent(); }
  void giveBack() { loan_.giveBack(); }

 private:
  std::function<void(const Result&)> answer_;
  std::int64_t longestWait_ns_;
  std::int64_t (*clock_)();
  Loan<Snapshot> loan_;
  bool lent_ = false;
  std::int64_t askedAt_ns_ = 0;  ///< 0: by nobody
};

}  // namespace tractiond
