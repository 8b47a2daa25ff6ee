// Zeros, calibration steps and the watch over the drift of the zero.
#pragma once

#include "base/clock.h"
#include "base/counter.h"
#include "base/error.h"
#include "base/mailbox.h"
#include "daemon/calibrate/drift_watch.h"
#include "daemon/calibrate/step_runner.h"
#include "daemon/records/gel_report.h"
#include "daemon/records/rest_drift.h"
#include "daemon/records/zero_request.h"
#include "daemon/track/zero.h"

#include <tl/expected.hpp>

#include <filesystem>
#include <functional>
#include <future>
#include <optional>
#include <string>

namespace tractiond {

struct ProcedureOptions {
  int zeroFrames = 30;                     ///< that a zero is averaged over
  std::filesystem::path directory;         ///< where a calibrated gel file goes
  std::int64_t (*clock)() = monotonicNow;  ///< [ns]
};

/// What the status tells of the procedures.
struct Watched {
  RestDrift drift;
  double zeroWithin_s = 0.0;  ///< a request for a zero that comes now is answered within this time [s]
};

/// Inputs, outputs and actions of the procedures. Called on their thread; everything outlives them.
struct ProcedureLinks {
  const Counter& frames;          ///< that the tracker has looked at
  Mailbox<MarkerField>& markers;  ///< the newest, in
  Mailbox<Watched>& watched;      ///< the newest, out

  // The tracker's.
  std::function<void()> requestZero;
  std::function<bool()> cancelZero;
  std::function<track::ZeroState()> zeroState;
  std::function<bool(RestPose&)> takeRestPose;
  /// Hands a judged zero to the tracker, and tells whether the gel file fits it. Returns false: try again later.
  std::function<bool(const RestPose&, bool fits)> putInForce;

  /// Compares a zero with the gel file. Called once for every zero that is kept or comes into force, the restored one
  /// included, and before the disk is asked to keep it: what presses later hides markers.
  std::function<GelReport(const RestPose&)> judge;
  /// Tells the tracker and the status what judge() has returned for a zero that comes into force.
  std::function<void(const RestPose&, const GelReport&)> tellJudgement;
  std::function<void(const RestPose&)> describe;  ///< publishes the description with the zero in force
  /// Starts to write the zero into the state directory, and the previous zero if there is one. The future is ready when
  /// both are on the disk.
  std::function<std::future<tl::expected<void, Error>>(const RestPose&, const RestPose* before)> keep;
  /// Starts work of a calibration step, which may take seconds or wait for a disk, on another thread.
  std::function<std::future<std::optional<calibrate::Result>>(calibrate::StepLinks::Work)> startWork;

  // The control server's.
  std::function<void(const tl::expected<RestPose, std::string>&, const std::string& remark)> answerZero;
  std::function<void(const calibrate::Result&)> answerCalibration;
};

/// Answers each request once: a zero within Watched::zeroWithin_s, a calibration step within the time of
/// CalibrationOptions plus twice kNoFrames_ns, and StepRunner::kWorkWithin_ns before and after it. A request for a zero
/// that was answered with an error changes nothing later. Thread-bound.
class Procedures {
 public:
  /// The sensor in force outlives this.
  Procedures(const sensor::Sensor& sensor, ProcedureOptions options, ProcedureLinks links);

  /// Must be called when the camera has been opened first.
  /// \param rate_Hz   of its frames; 0: not known
  /// \param restored  the zero of an earlier run, if there is one
  /// \param before    the zero that it replaced
  void welcome(const std::string& cameraId, double rate_Hz, const std::optional<RestPose>& restored,
               const std::optional<RestPose>& before = {});

  /// Handles a request for a zero; the answer comes in the turn in which it is known. Must not be called while another
  /// request for a zero is open. The zero comes into force when it has been written to the disk; until then the
  /// previous one stays in force. A zero in which something seems to touch, or that cannot be written, is refused.
  void beginZero(const ZeroRequest& request);

  /// Handles a request for a calibration step. Drops a running step without an answer: the control server has answered
  /// it. A step that needs the zero ends an open request for a zero, which is answered with an error.
  void beginStep(const CalibrationStep& step);

  /// Does what is due. Called by the control thread in each turn of its loop.
  void turn();

  /// Tells whether a step is running, so that turns should be short enough for every frame to be looked at.
  bool hurried() const { return steps_.isLooking(); }

  /// Requests fail when the tracker has seen no frame for this long.
  static constexpr std::int64_t kNoFrames_ns = 5'000'000'000;
  /// A zero that has not been written to the disk after this time is refused.
  static constexpr std::int64_t kKeptWithin_ns = 60'000'000'000;

 private:
  /// Number of frames at a moment.
  struct Seen {
    std::uint64_t frames = 0;
    std::int64_t at_ns = 0;
  };

  /// A zero that is being written to the disk.
  struct Keeping {
    std::future<tl::expected<void, Error>> done;
    std::int64_t until_ns;
    bool isAwaited;          ///< the open request for a zero is answered when it is done
    bool isRefused = false;  ///< the request has been refused because the disk took too long
    std::function<void(const tl::expected<void, Error>&)> then;
  };

  void undoZero();
  void heedTaken();
  void keep(const RestPose& zero, const RestPose* before, bool isAwaited,
            std::function<void(const tl::expected<void, Error>&)> then);
  void watchKeeping();
  void rewrite();
  void tellRewritten(const tl::expected<void, Error>& kept);
  void putInForce(const RestPose& zero, const GelReport& report);
  void heedJudgement(const RestPose& zero, const GelReport& report);
  void handOver();
  void dropStep();
  void watchZero();
  void refuseZero(const std::string& reason);
  void answerZero(const tl::expected<RestPose, std::string>& result, const std::string& remark = "");
  void watchMarkers();
  void answerStep(const calibrate::Result& result);
  void measureRate();
  double takenWithin_s() const;
  Seen seen() const;
  bool noFrames(Seen& last) const;

  const sensor::Sensor& sensor_;
  ProcedureOptions options_;
  ProcedureLinks links_;
  std::string camera_;            ///< empty: none yet
  std::optional<RestPose> zero_;  ///< in force
  std::optional<RestPose> before_;
  bool puttingInForce_ = false;  ///< zero_ is still to be handed to the tracker
  bool fits_ = true;             ///< the gel file fits zero_
  std::optional<Keeping> keeping_;
  std::optional<std::int64_t> rewriteAt_ns_;  ///< none: the zero in force is on the disk, or is being written
  bool isUnwritten_ = false;                  ///< the log says that it could not be written
  RestPose finished_;
  MarkerField markers_;
  calibrate::DriftWatch driftWatch_;
  calibrate::StepRunner steps_;
  double rate_Hz_ = 0.0;  ///< 0: not known
  Seen rateSince_;
  bool zeroAsked_ = false;
  ZeroRequest request_;
  std::int64_t zeroUntil_ns_ = 0;
  Seen lastForZero_, lastForStep_;  ///< when a frame was seen last
};

}  // namespace tractiond
