// From pictures to marker displacements.
#pragma once

#include "base/mailbox.h"
#include "daemon/records/marker_field.h"
#include "daemon/records/marker_sight.h"
#include "daemon/records/snapshot.h"
#include "daemon/records/tracker_inputs.h"
#include "daemon/track/follower.h"
#include "daemon/track/pixel_noise.h"
#include "daemon/track/reference.h"
#include "daemon/track/zero.h"
#include "sensor/sensor.h"

#include <atomic>
#include <optional>

namespace tractiond::track {

struct TrackOptions {
  int zeroFrames = 30;            ///< averaged for a rest pose: its error is then a fifth of one frame's
  double minValidFraction = 0.5;  ///< of the markers; below, the field is flagged kFewMarkers and no zero is taken
  /// The first zero, or a restored one, is used after judge() has been called for it; a requested one only after
  /// putInForce().
  bool awaitJudge = false;
};

enum class Outcome {
  kTracked,     ///< the field holds this frame
  kNoRestPose,  ///< the first rest pose is still being taken, or not judged yet: there is nothing to displace from
};

/// Thread-bound but for the functions marked thread-safe. track() allocates nothing, except in the first frame of a
/// pixel format and in frames in which it learns what markers look like: the first in which markers are found, and the
/// first after requestZero().
///
/// A requested zero is a candidate: a second follower learns what markers look like, and the zero is taken from its
/// places, while the first one goes on with the zero in force. A candidate that is refused leaves nothing behind.
///
/// A zero is verified, and the fields carry no kZeroUnverified, once
/// - a zero was taken in this run because requestZero() was called, or
/// - the restored rest pose had been requested, and since the start ten frames running have shown displacements no
///   larger than three deviations of the noise (rms over the markers): the unloaded picture agrees with it.
class Tracker {
 public:
  /// The sensor is trackable(), with the pictures' format as well.
  Tracker(const sensor::Sensor& sensor, const TrackOptions& options);

  /// Before the first frame. The pose has as many markers as the sensor.
  void restore(const RestPose& pose);

  /// `field` has been sized for all markers. The frame has the size of the sensor's camera.
  Outcome track(const Frame& frame, MarkerField& field);

  /// Takes a new zero from the next frames, at most 2 zeroFrames; the old one stays in force meanwhile, with awaitJudge
  /// until putInForce(). What markers look like is learned anew for it, as the lens may have been refocused.
  /// Thread-safe.
  void requestZero() { zeroState_.store(ZeroState::kRequested, std::memory_order_relaxed); }

  /// Cancels the request: no zero will come of it. Returns false if there is no request to cancel: the automatic first
  /// zero cannot be cancelled, and after a requestZero() that has not failed, its zero has been taken, and
  /// takeRestPose() returns it as soon as track() has returned. Thread-safe.
  bool cancelZero();

  /// Thread-safe.
  ZeroState zeroState() const { return zeroState_.load(std::memory_order_relaxed); }

  /// Number of still frames that a zero is averaged over.
  int zeroFrames() const { return options_.zeroFrames; }

  /// The newest finished rest pose, once, for keeping. Thread-safe, for one thread.
  bool takeRestPose(RestPose& pose) { return finished_.take(pose); }

  /// Puts a zero in force from the next frame on: the one that takeRestPose() returned last, or an earlier one. An
  /// earlier one is verified if it was when it was replaced last, and the appearance of the markers is restored with
  /// it. Called with the zero that is in force, it rejects the one that was taken since. \param fits as in judge()
  /// \return false: try again later. Thread-safe, for one thread.
  bool putInForce(const RestPose& pose, bool fits) { return decisions_.put({pose, fits}); }

  /// Does the gel file fit the picture that this zero was taken from? Where it does not, the fields carry kGelMismatch.
  /// Ignored unless the zero is in force. Thread-safe, for one thread.
  void judge(const Id& zero, bool fits);

  /// There is a zero, and none has been judged yet: track() would find no displacements. Called from track()'s thread.
  bool awaitsFirstVerdict();

  /// What the frame tracked last heeded of the calls above. Valid until the next.
  const TrackerInputs& inputs() const { return inputs_; }
  /// Before track(): the frame heeds these, as one before heeded them. Nobody else calls anything meanwhile.
  void repeat(const TrackerInputs& inputs);

  /// Of the newest frame, once. Thread-safe, for one thread.
  bool takeSight(MarkerSight& sight) { return sights_.take(sight); }

  /// Makes the room that show() needs. Allocates; reentrant.
  void prepare(Snapshot& snapshot) const;
  /// Where the markers are in the frame tracked last: all of a snapshot but the picture.
  void show(Snapshot& snapshot) const;

 private:
  /// A zero that the tracker can go back to.
  struct Standing {
    Id zero{};
    bool verified = false;
    Appearance appearance = {};  ///< known only if markers were seen while the zero was in force
  };

  void reportSight();
  void write(const FrameInfo& info, bool relabelled, MarkerField& field);

  // The zero.
  void heedRequest();
  void beginZero(bool requested);
  void takeZero(const FrameInfo& info);
  bool report(ZeroState state);
  void finishPose(const FrameInfo& info);
  void install(const RestPose& pose);
  void heedDecision();
  void heedVerdict();

  const Follower& source() const { return takingRequested_ ? candidate_ : follower_; }

  TrackOptions options_;
  int markers_;
  FollowerWorkspace workspace_;
  Follower follower_;   ///< measures from the zero in force
  Follower candidate_;  ///< beside it, of the zero that was requested, while that is taken

  Id zero_{};  ///< in force
  bool zeroWasRequested_ = false, verified_ = false;
  Standing before_;   ///< of the zero that this one replaced
  int agreeing_ = 0;  ///< frames running that agree with the restored pose

  ZeroTaker taker_;
  PixelNoise pixelNoise_;
  bool taking_ = false, takingRequested_ = false;
  int tornWhileTaking_ = 0;
  RestPose pose_;  ///< in the making, or waiting for the mailbox
  bool poseWaits_ = false;
  std::atomic<ZeroState> zeroState_{ZeroState::kNone};
  Mailbox<RestPose> finished_;
  std::optional<std::int64_t> proposed_ns_;  ///< when the zero was taken that waits for putInForce()
  Appearance proposed_;                      ///< what markers look like for it

  struct Decision {
    RestPose zero;
    bool fits = false;
  };
  Mailbox<Decision> decisions_;
  Decision decision_;

  struct Verdict {
    Id zero{};
    bool fits = false;
  };
  Verdict verdict_;  ///< on the zero in force; of another: not known
  Mailbox<Verdict> verdicts_;
  Verdict heard_;
  bool newVerdict_ = false;  ///< heard, not heeded yet
  TrackerInputs inputs_;
  bool forgo_ = false;  ///< the zero that would be finished with the next frame
  MarkerSight sight_;
  Mailbox<MarkerSight> sights_;
};

}  // namespace tractiond::track
