// What is done with the gel on somebody's request, or watched over meanwhile: the zero, the steps of a calibration, the
// drift.
#pragma once

#include "daemon/base/clock.h"
#include "daemon/base/counter.h"
#include "daemon/base/error.h"
#include "daemon/base/mailbox.h"
#include "daemon/calibrate/calibration.h"
#include "daemon/calibrate/drift_watch.h"
#include "daemon/records/rest_drift.h"
#include "daemon/records/zero_request.h"
#include "daemon/track/zero.h"

#include <tl/expected.hpp>

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

namespace tractiond {

struct ProcedureOptions {
  int zeroFrames = 30;                      ///< that a zero is averaged over
  std::filesystem::path directory;          ///< where a calibrated gel file goes
  sensor::elastic::Progress progress = {};  ///< of a calibration's mechanics
  std::int64_t (*clock)() = monotonicNow;   ///< [ns]
};

/// What the procedures have to say of themselves.
struct Watched {
  RestDrift drift;
  double zeroWithin_s = 0.0;  ///< a zero that is asked for now is answered within this time [s]
};

/// What the procedures read, act upon and answer through. Called on their thread; all of it outlives them.
struct ProcedureLinks {
  const Counter& frames;          ///< that the tracker has looked at
  Mailbox<MarkerField>& markers;  ///< the newest, in
  Mailbox<Watched>& watched;      ///< the newest, out

  // The tracker's.
  std::function<void()> requestZero;
  std::function<bool()> cancelZero;
  std::function<track::ZeroState()> zeroState;
  std::function<bool(RestPose&)> takeRestPose;
  std::function<bool(const RestPose&)> putBack;  ///< false: try again later

  /// Every zero comes by here before it is described, the restored one too. What speaks against it, for people: empty,
  /// or a sentence.
  std::function<std::string(const RestPose&)> judge;
  std::function<void(const RestPose&)> describe;  ///< tells subscribers of the zero in force
  /// Writes it into the state directory, and the one before it where there is one.
  std::function<tl::expected<void, Error>(const RestPose&, const RestPose* before)> keep;
  /// Does what may wait for a disk, and returns when it is done.
  std::function<void(const std::function<void()>&)> slowly;

  // The control server's.
  std::function<void(const tl::expected<RestPose, std::string>&, const std::string& remark)> answerZero;
  std::function<void(const calibrate::Result&)> answerCalibration;
};

/// Each request gets one answer: a zero within the time that is told of it, a step of a calibration within that of
/// CalibrationOptions and twice kNoFrames_ns. When a zero's answer is an error, no zero comes of the request later.
/// Thread-bound.
class Procedures {
 public:
  /// The sensor in force outlives this.
  Procedures(const sensor::Sensor& sensor, ProcedureOptions options, ProcedureLinks links);

  /// The camera has been opened. \param rate_Hz of its frames; 0: it does not tell. \param restored the zero kept from
  /// an earlier run, if there is one. \param before the one that it replaced.
  void welcome(const std::string& cameraId, double rate_Hz, const std::optional<RestPose>& restored,
               const std::optional<RestPose>& before = {});

  /// Somebody asks for a zero; the answer comes with the turn in which it is known. Not while a zero is asked for. A
  /// zero in which something seems to touch, or that cannot be kept, is refused, and the one before put back.
  void beginZero(const ZeroRequest& request);

  /// Somebody asks for a step; a step that runs is dropped without an answer: its asker has been told. A step that
  /// rests on the zero takes over from a zero that is asked for, and that one is answered.
  void beginStep(const CalibrationStep& step);

  /// Does what is due.
  void turn();

  /// Somebody waits for a step: every frame should be looked at.
  bool hurried() const { return calibration_.running(); }

  /// What is asked for fails when the tracker sees no frame for this long.
  static constexpr std::int64_t kNoFrames_ns = 5'000'000'000;

 private:
  /// Frames by a moment.
  struct Seen {
    std::uint64_t frames = 0;
    std::int64_t at_ns = 0;
  };

  void undoZero();
  void keepZero();
  void putBack();
  void dropStep();
  void watchZero();
  void refuseZero(const std::string& reason);
  void answerZero(const tl::expected<RestPose, std::string>& result, const std::string& remark = "");
  void watchMarkers();
  void answerStep(const calibrate::Result& result);
  void measureRate();
  double zeroWithin_s() const;
  Seen seen() const;
  bool noFrames(Seen& last) const;

  const sensor::Sensor& sensor_;
  ProcedureOptions options_;
  ProcedureLinks links_;
  std::string camera_;            ///< empty: none yet
  std::optional<RestPose> zero_;  ///< in force
  std::optional<RestPose> before_;
  bool puttingBack_ = false;  ///< zero_, when the tracker takes it
  RestPose finished_;
  MarkerField markers_;
  calibrate::DriftWatch driftWatch_;
  calibrate::Calibration calibration_;
  double rate_Hz_ = 0.0;  ///< 0: not known
  Seen rateSince_;
  bool zeroAsked_ = false;
  ZeroRequest request_;
  std::int64_t zeroUntil_ns_ = 0;
  Seen lastForZero_, lastForStep_;  ///< when a frame was seen last
};

}  // namespace tractiond
