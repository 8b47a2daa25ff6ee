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

/// What the procedures read, act upon and answer through. Called on their thread; all of it outlives them.
struct ProcedureLinks {
  const Counter& frames;          ///< as they come from the camera
  Mailbox<MarkerField>& markers;  ///< the newest, in
  Mailbox<RestDrift>& drift;      ///< the newest, out

  // The tracker's.
  std::function<void()> requestZero;
  std::function<track::ZeroState()> zeroState;
  std::function<bool(RestPose&)> takeRestPose;

  /// Every zero comes by here before it is described, the restored one too. What speaks against it, for people: empty,
  /// or a sentence.
  std::function<std::string(const RestPose&)> judge;
  std::function<void(const RestPose&)> describe;                   ///< tells subscribers of the zero in force
  std::function<tl::expected<void, Error>(const RestPose&)> keep;  ///< writes it into the state directory

  // The control server's.
  std::function<void(const tl::expected<RestPose, std::string>&, const std::string& remark)> answerZero;
  std::function<void(const calibrate::Result&)> answerCalibration;
};

/// Thread-bound.
class Procedures {
 public:
  /// The sensor in force outlives this.
  Procedures(const sensor::Sensor& sensor, ProcedureOptions options, ProcedureLinks links);

  /// A camera has been opened. \param restored the zero kept from an earlier run, if there is one.
  void welcome(const std::string& cameraId, const std::optional<RestPose>& restored);

  /// Somebody asks for a zero; the answer comes with the turn in which it is known.
  void beginZero();

  /// Somebody asks for a step; a step that runs is dropped without an answer: its asker has been told.
  void beginStep(const CalibrationStep& step);

  /// Does what is due.
  void turn();

  /// Somebody waits for a step: every frame should be looked at.
  bool hurried() const { return calibration_.running(); }

 private:
  /// When a frame came last, since something was asked for.
  struct Patience {
    std::uint64_t frames = 0;
    std::int64_t last_ns = 0;
  };

  void keepZero();
  void watchZero();
  void watchMarkers();
  void answerZero(const tl::expected<RestPose, std::string>& result, const std::string& remark = "");
  Patience patience() const;
  bool noFrames(Patience& patience) const;

  const sensor::Sensor& sensor_;
  ProcedureOptions options_;
  ProcedureLinks links_;
  std::string camera_;            ///< empty: none yet
  std::optional<RestPose> zero_;  ///< in force
  RestPose finished_;
  MarkerField markers_;
  calibrate::DriftWatch driftWatch_;
  calibrate::Calibration calibration_;
  bool zeroAsked_ = false;
  Patience zeroPatience_, stepPatience_;
};

}  // namespace tractiond
