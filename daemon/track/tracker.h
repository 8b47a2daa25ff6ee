// Computes the displacements of the markers from pictures, and takes zeros.
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
#include "daemon/track/zero_tracker.h"
#include "sensor/sensor.h"

#include <atomic>
#include <optional>

namespace tractiond::track {

struct TrackOptions {
  int zeroFrames = 30;            ///< averaged for a rest pose; its error is then a fifth of one frame's
  double minValidFraction = 0.5;  ///< share of valid markers below which fields get kFewMarkers and no zero is taken
  bool followsDrift = true;       ///< whether the zero is followed while nothing touches (calibrate::ZeroTracking)
  /// The first zero, or a restored one, is used after setGelFits() has been called for it; a requested one only after
  /// putInForce().
  bool awaitsGelCheck = false;
};

enum class Outcome {
  kTracked,     ///< the field holds this frame
  kNoRestPose,  ///< no zero is in force yet: the first is still being taken, or was not compared with the gel file
                ///< yet. The field must not be used, although in the latter case its markers may be marked as valid
};

/// Thread-bound, except for the functions marked thread-safe. track() allocates nothing, except in the first frame of a
/// pixel format and in frames in which it learns the markers' appearance: the first in which markers are found, and the
/// first after requestZero(), or after frames that a zero gave up because of a trend in their light.
///
/// A requested zero is a candidate: a second follower learns the appearance, and the zero is taken from its places,
/// while the first one continues with the zero in force. A refused candidate leaves no trace.
///
/// A zero is verified, and the fields carry no kZeroUnverified, once
/// - a zero was taken in this run because requestZero() was called, or
/// - the restored rest pose had been requested, and since the start ten frames in a row have shown displacements of at
///   most three deviations of the noise (rms over the markers): the unloaded picture agrees with it.
class Tracker final : public ZeroTracker {
 public:
  /// The sensor must be trackable(), also with the pictures' format; it need not outlive the tracker.
  Tracker(const sensor::Sensor& sensor, const TrackOptions& options);

  /// Sets the zero of an earlier run, which is in force from the first frame. May only be called before that. The pose
  /// must have as many markers as the sensor.
  void restore(const RestPose& pose);

  /// Finds the markers in a frame and fills `field`, whatever it returns, with their displacements from the zero in
  /// force and the flags. Without a zero no marker of the field is valid. Takes the zero that is under way.
  /// \param frame of the size of the sensor's camera
  /// \param field resize()d for all markers
  Outcome track(const Frame& frame, MarkerField& field);

  // These implement ZeroTracker.
  void requestZero() override { zeroState_.store(ZeroState::kRequested, std::memory_order_relaxed); }
  bool cancelZero() override;
  ZeroState zeroState() const override { return zeroState_.load(std::memory_order_relaxed); }
  bool takeRestPose(RestPose& pose) override { return finished_.take(pose); }
  bool putInForce(const RestPose& pose, bool fits) override { return decisions_.put({pose, fits}); }

  /// Returns the number of still frames that a zero averages. Thread-safe.
  int zeroFrames() const { return options_.zeroFrames; }

  /// States whether the gel file fits the picture of this zero. If not, the fields carry kGelMismatch. Ignored unless
  /// the zero is in force in the next frame. Waits for some instructions of track() at most. Thread-safe, for one
  /// thread.
  void setGelFits(const Id& zero, bool fits);

  /// Returns whether there is a zero, and setGelFits() has been called for none: track() would return kNoRestPose.
  /// False without awaitsGelCheck. For track()'s thread.
  bool awaitsFirstVerdict();

  /// Returns which of the calls above have taken effect with the last frame. Valid until the next frame. For track()'s
  /// thread.
  const TrackerInputs& inputs() const { return inputs_; }
  /// Repeats what took effect with a recorded frame (inputs()). Must be called before track() of that frame, while no
  /// other thread calls anything.
  void repeat(const TrackerInputs& inputs);

  /// Copies what was seen in the newest frame into `sight`. Returns false, and leaves it as it is, if there was no
  /// frame since the last call. Does not wait. Thread-safe, for one thread.
  bool takeSight(MarkerSight& sight) { return sights_.take(sight); }

  /// Allocates the room that fill() needs. Thread-safe.
  void prepare(Snapshot& snapshot) const;
  /// Fills in the places and states of the markers and the spots in the last frame: all of a snapshot except the
  /// picture. Must follow prepare(); then allocates nothing. For track()'s thread.
  void fill(Snapshot& snapshot) const;

 private:
  void reportSight();
  void write(const FrameInfo& info, bool relabelled, MarkerField& field);

  // The zero.
  void noteRequest();
  void beginZero(bool requested);
  void takeZero(const FrameInfo& info);
  bool report(ZeroState state);
  void finishPose(const FrameInfo& info);
  void install(const RestPose& pose);
  void noteDecision();
  void noteVerdict();

  const Follower& source() const { return takingRequested_ ? candidate_ : follower_; }

  TrackOptions options_;
  int markers_;
  FollowerWorkspace workspace_;
  Follower follower_;   ///< measures from the zero in force
  Follower candidate_;  ///< of the requested zero, while that is taken

  Id zero_{};  ///< in force
  bool zeroWasRequested_ = false, verified_ = false;
  Id before_{};  ///< the zero that this one replaced
  bool beforeWasVerified_ = false;
  int agreeing_ = 0;  ///< number of frames in a row that agree with the restored pose

  ZeroTaker taker_;
  PixelNoise pixelNoise_;
  bool taking_ = false, takingRequested_ = false;
  int discarded_ = 0;         ///< frames of the zero that were torn, or came before a new begin
  bool wasUnsteady_ = false;  ///< the zero began anew
  RestPose pose_;             ///< in the making, or waiting for the mailbox
  bool poseWaits_ = false;
  std::atomic<ZeroState> zeroState_{ZeroState::kNone};
  Mailbox<RestPose> finished_;
  std::optional<std::int64_t> proposed_ns_;  ///< time of the zero that awaits putInForce()
  Appearance proposed_;                      ///< appearance of the markers for it

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
  Verdict verdict_;  ///< on the zero in force; if it has another id: not known
  Mailbox<Verdict> verdicts_;
  Verdict heard_;
  bool newVerdict_ = false;  ///< received, without effect yet
  TrackerInputs inputs_;
  bool forgo_ = false;  ///< drops the zero that the next frame would finish
  MarkerSight sight_;
  Mailbox<MarkerSight> sights_;
};

}  // namespace tractiond::track
