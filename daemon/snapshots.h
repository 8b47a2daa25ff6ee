// Copies of single frames for the control thread: for requests of a snapshot, and for the daemon's own examinations.
#pragma once

#include "base/clock.h"
#include "base/loan.h"
#include "daemon/records/snapshot.h"

#include <tl/expected.hpp>

#include <functional>
#include <string>

namespace tractiond {

/// The copy and the requests that wait for it. Bound to the control thread, except for lent() and giveBack().
class Snapshots {
 public:
  using Result = tl::expected<const Snapshot*, std::string>;

  /// \param answer          called in take() or turn() after ask(), with the copy, or why there is none
  /// \param longestWait_s   for a frame, after a request
  explicit Snapshots(std::function<void(const Result&)> answer, double longestWait_s = 3.0,
                     std::int64_t (*clock)() = monotonicNow);

  /// Returns the record, to allocate room before the first turn.
  Snapshot& room() { return *loan_.own(); }

  /// Requests a copy of the next frame.
  void ask() { askedAt_ns_ = clock_(); }

  /// Returns the copy that was made since the last call, and answers the requests; null: there is none.
  const Snapshot* take();

  /// Requests a copy of the next frame if there are requests or `isWanted`; refuses requests that have waited too long.
  void turn(bool isWanted = false);

  // For the tracking thread.

  /// Returns the room for a copy of the frame; null: none is wanted.
  Snapshot* lent() { return loan_.lent(); }
  void giveBack() { loan_.giveBack(); }

 private:
  std::function<void(const Result&)> answer_;
  std::int64_t longestWait_ns_;
  std::int64_t (*clock_)();
  Loan<Snapshot> loan_;
  bool lent_ = false;
  std::int64_t askedAt_ns_ = 0;  ///< 0: there is no request
};

}  // namespace tractiond
