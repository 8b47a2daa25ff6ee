// Copies single frames for the control thread: for clients that request a snapshot, and for the daemon's own checks.
#pragma once

#include "base/clock.h"
#include "base/loan.h"
#include "daemon/control/requests.h"
#include "daemon/records/snapshot.h"

#include <cstddef>
#include <string>
#include <vector>

namespace tractiond::control {

/// Holds one copy and the open request for it. Bound to the control thread, except for lent() and giveBack().
class Snapshots {
 public:
  /// \param replies gets the answer to ask() within take() or turn(): the copy, which is valid during the call, or a
  /// sentence that states why there is none; nullptr: ask() is not called
  /// \param layers layers of the markers that copies hold
  /// \param clock [ns]
  explicit Snapshots(Replies* replies, std::vector<sensor::MarkerLayer> layers = {},
                     std::int64_t (*clock)() = monotonicNow);

  /// Returns the copy, to reserve memory for the markers that it is to hold. May only be called before the first
  /// turn().
  Snapshot& room() { return *loan_.own(); }

  /// Takes over what the camera of a new session sends: bytes of a frame, for which memory is reserved before a copy is
  /// wanted, and what it waits for before it sends (CameraInfo::waits()), for answers that there is none.
  void setCamera(std::size_t frame_bytes, std::string waits);

  /// Requests a copy of the next frame, which is given to Replies::answerSnapshot(). One request at a time.
  void ask() { askedAt_ns_ = clock_(); }

  /// Returns the copy that has been made since the last call, and answers an open request with it; nullptr: there is
  /// none, or the frame was larger than the memory, which is then enlarged for the next one. Valid until the next
  /// turn(). Does not wait.
  const Snapshot* take();

  /// Asks the tracking thread for a copy of the next frame if a request is open or `isWanted`; answers a request that
  /// has waited for 3 s with an error. Does not wait.
  /// \param isWanted the caller itself wants what take() returns
  void turn(bool isWanted = false);

  // For the tracking thread.

  /// Returns the memory for a copy of the frame; nullptr if none is wanted. giveBack() must follow.
  Snapshot* lent() { return loan_.lent(); }
  /// Hands the copy over to the control thread, also one that does not fit (FrameCopy::fits).
  void giveBack() { loan_.giveBack(); }

 private:
  Replies* replies_;
  std::vector<sensor::MarkerLayer> layers_;
  std::int64_t (*clock_)();
  Loan<Snapshot> loan_;
  bool lent_ = false;
  std::int64_t askedAt_ns_ = 0;  ///< 0: there is no request
  std::size_t frame_bytes_ = 0;
  std::string waits_;
};

}  // namespace tractiond::control
