// From pictures to marker displacements.
#pragma once

#include "base/mailbox.h"
#include "daemon/records/marker_field.h"
#include "daemon/records/marker_sight.h"
#include "daemon/records/snapshot.h"
#include "daemon/records/tracker_inputs.h"
#include "daemon/track/centre.h"
#include "daemon/track/centre_errors.h"
#include "daemon/track/detection.h"
#include "daemon/track/labelling.h"
#include "daemon/track/lattice.h"
#include "daemon/track/pixel_noise.h"
#include "daemon/track/planes.h"
#include "daemon/track/tear_finder.h"
#include "daemon/track/zero.h"
#include "sensor/sensor.h"

#include <atomic>
#include <optional>
#include <span>
#include <vector>

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
  /// until putInForce(). Learns the appearance of the markers anew, as the lens may have been refocused. Thread-safe.
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
  /// Least amplitude of a marker that is believed, relative to rest.
  static constexpr float kDim = 0.5F;

  struct Layer {
    std::size_t index;  ///< of its planes
    Lattice lattice;
    int rank;          ///< in a rest pose's cross-talk
    double radius_px;  ///< as described; once markers are labelled, as the typical one of them shows it
    bool nearer;       ///< to the camera than the other layer: its markers hide the other's
    Trust trust;
    std::vector<MarkerTemplate> markers = {};  ///< the first is of the typical size
    CrossTalk crossTalk = {};
    std::vector<MarkerTemplate> markersBefore = {};  ///< the zero that is being taken
    CrossTalk crossTalkBefore = {};
    Plane plane = {}, otherPlane = {};  ///< of this frame
    std::vector<Spot> spots = {};
    MarkerTemplate rough = {};  ///< for spots whose blur is not known yet
    float roughScale = 0.0F;    ///< of the plane that it is for; 0: none yet
    double described_px = 0.0;  ///< radius
  };

  // One frame.
  bool acquire();  ///< false: the picture could not be labelled
  void follow();
  void finishFrame(bool thorough);
  void recover();
  bool recoverOne(const Layer& layer, int marker, int column, int row);
  bool searchAround(const Layer& layer, int marker, Vector place);
  bool fitAt(const Layer& layer, int marker, Vector place);
  bool adoptDeformed(const Layer& layer, int marker, float mostMisfit);
  Guess guessAt(int marker, Vector place) const;
  void heedSlope(const Layer& layer, int marker, Centre& centre);
  void learnSlopes();
  bool accept(int marker, const Centre& centre, Vector expected);
  void markOverlaps();
  void guessLost();
  void write(const FrameInfo& info, bool relabelled, MarkerField& field);

  // The start and the zero.
  const MarkerTemplate& roughOf(Layer& layer);
  bool latticesFit() const;
  void reportSight();
  void learnSize(Layer& layer, std::span<const std::uint8_t> seen);
  void learnAppearance(std::span<const std::uint8_t> seen);
  void relearnAppearance();
  void restoreAppearance();
  void placeUnlabelled();
  void assumeRest();
  void heedRequest();
  void beginZero(bool requested);
  void takeZero(const FrameInfo& info);
  bool report(ZeroState state);
  void adopt(const RestPose& pose);
  void heedDecision();
  void heedVerdict();

  bool wanted(int marker) const { return present_[marker] || taking_; }
  int countValid() const;
  int countWanted() const;

  template <typename T>
  std::span<T> ofLayer(std::vector<T>& all, const Layer& layer) {
    return std::span(all).subspan(static_cast<std::size_t>(layer.lattice.first),
                                  static_cast<std::size_t>(layer.lattice.count()));
  }

  TrackOptions options_;
  int markers_;
  std::vector<Layer> layers_;
  Planes planes_;
  std::vector<Vector> nominal_;  ///< where the markers are by the sensor's description [px]
  float spacing_px_;

  // The rest pose in force, or what stands in for it while the first is taken.
  std::vector<Vector> rest_;
  std::vector<float> restAmplitude_;
  std::vector<std::uint8_t> present_;
  int isolatedGaps_ = 0;  ///< see MarkerField
  Id zero_{};
  bool haveRest_ = false, haveAppearance_ = false;
  bool newAppearance_ = false;  ///< since the frame before
  bool zeroWasRequested_ = false, verified_ = false;
  struct Standing {
    Id zero{};
    bool verified = false;
  };
  Standing before_;   ///< of the zero that this one replaced
  int agreeing_ = 0;  ///< frames running that agree with the restored pose

  // Per marker. A marker that is lost has a place too: where its neighbours say it is.
  std::vector<Vector> place_, previous_, velocity_;
  std::vector<Vector> displacement_, increment_;
  std::vector<std::uint8_t> valid_, wasValid_, stepped_;  ///< stepped: valid now and in the frame before
  std::vector<std::uint8_t> mixed_, attempts_;
  std::vector<std::uint8_t> size_, sizeBefore_;  ///< which of its layer's templates; before: the zero being taken
  std::vector<Vector> slope_;                    ///< of the surroundings' brightness [levels / px]
  std::vector<std::uint8_t> slopeFrames_;        ///< that it is the mean of; 0: of this frame alone
  std::vector<Vector> labelPlace_;
  std::vector<std::uint8_t> labelled_;
  std::vector<int> lostFor_;  ///< frames
  std::vector<int> lost_;
  std::vector<Guess> guesses_;
  std::vector<Centre> centres_;
  bool following_ = false;
  int acquireIn_ = 0;  ///< frames until the next try
  int searches_ = 0;   ///< wide searches left in this frame
  unsigned frames_ = 0;
  bool torn_ = false;

  Detector detector_;
  Labeller labeller_;
  PointGrid grid_;
  TearFinder tears_;
  CentreErrors errors_;

  ZeroTaker taker_;
  PixelNoise pixelNoise_;
  bool taking_ = false, takingRequested_ = false;
  bool haveAppearanceBefore_ = false;
  Id appearanceBeforeOf_{};  ///< the zero that was in force with it
  int tornWhileTaking_ = 0;
  RestPose pose_;  ///< in the making, or waiting for the mailbox
  bool poseWaits_ = false;
  std::atomic<ZeroState> zeroState_{ZeroState::kNone};
  Mailbox<RestPose> finished_;
  std::optional<std::int64_t> proposed_ns_;  ///< when the zero was taken that waits for putInForce()

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
