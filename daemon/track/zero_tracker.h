// Interface of the tracker for zeros, by which the control thread requests, takes and decides on them.
#pragma once

#include "daemon/records/marker_field.h"
#include "daemon/track/zero.h"

namespace tractiond::track {

/// All functions are thread-safe, for one thread each, and do not wait.
class ZeroTracker {
 public:
  /// Requests a new zero from the next frames, at most 2 zeroFrames: torn ones, and those before the light is steady,
  /// are left out. The old one stays in force meanwhile; with TrackOptions::awaitsGelCheck until putInForce(). A
  /// requested zero that is being taken is begun again. The appearance is learned anew for it, as the lens may have
  /// been refocused. Returns at once; zeroState() shows how it goes.
  virtual void requestZero() = 0;

  /// Cancels a request. Returns false if there is none to cancel: the automatic first zero cannot be cancelled; nor can
  /// a requested one that has been taken, which takeRestPose() returns as soon as track() has returned.
  virtual bool cancelZero() = 0;

  /// Returns the state of the last zero; of a restored one kNone.
  virtual ZeroState zeroState() const = 0;

  /// Copies the newest finished rest pose, requested or automatic, into `pose`. Returns false, and leaves it as it is,
  /// if there is none since the last call.
  virtual bool takeRestPose(RestPose& pose) = 0;

  /// Puts a zero in force from the next frame on: the one that takeRestPose() returned last, or an earlier one. The
  /// former is verified, and the markers' appearance changes with it. The one that was in force before this one is
  /// verified if it was then; any other zero only by agreeing frames, if it was requested. Called with the zero that is
  /// in force, it rejects the one that was taken since. Of several calls before a frame the last counts.
  /// \param fits as in Tracker::setGelFits()
  /// \return false: nothing has changed, as track() is reading the last call; try again later
  virtual bool putInForce(const RestPose& pose, bool fits) = 0;

 protected:
  ~ZeroTracker() = default;
};

}  // namespace tractiond::track
