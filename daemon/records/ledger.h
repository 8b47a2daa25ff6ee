// The account of every frame: received = published + each named loss + in flight.
#pragma once

#include "base/counter.h"

namespace tractiond {

/// Each group is written by the thread named in its comment.
struct Ledger {
  // capture thread: everything the driver handed over, good or bad
  Counter received;
  // capture thread: why a received buffer was not used
  Counter incomplete;   ///< the driver's status says that packets are missing, aborted, cleared ...
  Counter wrongSize;    ///< payload or picture size is not what was agreed
  Counter wrongFormat;  ///< pixel format is not what was agreed
  Counter stale;        ///< its id does not advance or its time does not rise: an old picture handed out again
  Counter implausible;  ///< id or time jumped ahead; held back until three frames in a row agree
  Counter evictedBeforeTrack;
  // track thread
  Counter noRestPose;  ///< used to find the markers and to take the zero; nothing to publish yet
  Counter noGel;       ///< could be looked at, and nothing was measured: there is no gel file
  Counter evictedBeforeSolve;
  // solve thread
  Counter evictedBeforePublish;
  // publish thread
  Counter published;
  // after the threads are joined
  Counter discardedAtStop;

  // Not part of the sum.
  Counter missing;     ///< never arrived, by gaps in the camera's ids (capture thread)
  Counter reconnects;  ///< camera lost and opened again (capture thread)
  Counter invalid;     ///< of the published: fields without forces (publish thread)
  Counter doubted;     ///< of the new ones: others may have sent them in the camera's name (capture thread)

  std::uint64_t losses() const {
    return incomplete.get() + wrongSize.get() + wrongFormat.get() + stale.get() + implausible.get() +
           evictedBeforeTrack.get() + noRestPose.get() + noGel.get() + evictedBeforeSolve.get() +
           evictedBeforePublish.get() + discardedAtStop.get();
  }
};

}  // namespace tractiond
