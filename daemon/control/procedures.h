// Handles requests for zeros and calibration steps, and measures the drift of the zero.
#pragma once

#include "base/clock.h"
#include "base/counter.h"
#include "base/mailbox.h"
#include "daemon/calibrate/drift_watch.h"
#include "daemon/control/step_runner.h"
#include "daemon/control/zero_procedure.h"
#include "daemon/records/frame_watch.h"
#include "daemon/records/rest_drift.h"

#include <filesystem>
#include <functional>
#include <future>
#include <optional>
#include <string>

namespace tractiond {

struct ProcedureOptions {
  int zeroFrames = 30;                     ///< number of frames that a zero is averaged over
  std::filesystem::path directory;         ///< where a calibrated gel file goes
  std::int64_t (*clock)() = monotonicNow;  ///< [ns]
};

/// What the status reports of the procedures.
struct Watched {
  RestDrift drift;            ///< of the zero in force
  double zeroWithin_s = 0.0;  ///< a request for a zero that arrives now is answered within this time [s]
};

/// Inputs, outputs and actions of the procedures. All functions must be set, and are called on their thread; what they
/// and the references refer to must outlive the procedures.
struct ProcedureLinks {
  const Counter& frames;          ///< number of frames that the tracker has processed
  Mailbox<MarkerField>& markers;  ///< input: the newest
  Mailbox<Watched>& watched;      ///< output: the newest
  zero::ZeroLinks zero;

  /// Starts work of a calibration step, which may take seconds or wait for a disk, on another thread.
  std::function<std::future<std::optional<calibrate::Result>>(calibrate::StepLinks::Work)> startWork;
  /// Answers the open request for a calibration step.
  std::function<void(const calibrate::Result&)> answerCalibration;
};

/// Answers each request once: a zero within Watched::zeroWithin_s, a calibration step within the time of
/// CalibrationOptions plus twice ZeroProcedure::kNoFrames_ns, and StepRunner::kWorkWithin_ns before and after it. A
/// request for a zero that was answered with an error changes nothing later. Bound to the control thread.
class Procedures {
 public:
  /// The sensor in force must outlive this. Reserves the memory of ProcedureLinks::markers by a put() and a take():
  /// must be made before another thread uses that mailbox, on any thread.
  Procedures(const sensor::Sensor& sensor, ProcedureOptions options, ProcedureLinks links);

  /// Takes over the camera and the zeros of an earlier run; see ZeroProcedure::welcome(). Must be called once, when the
  /// camera has been opened for the first time. \param cameraId calibrate::cameraId() \param rate_Hz of its frames,
  /// until it is measured; 0: not known \param restored the zero of an earlier run, if there is one \param before the
  /// zero that it replaced, if there is one \param isWritten as for ZeroProcedure::welcome()
  void welcome(const std::string& cameraId, double rate_Hz, const std::optional<RestPose>& restored,
               const std::optional<RestPose>& before = {}, bool isWritten = true);

  /// Sets what the camera of a new session waits for (CameraInfo::waits()), for answers that no frames come.
  void setWaits(const std::string& waits);

  /// Handles a request for a zero: see ZeroProcedure::begin().
  void beginZero(const ZeroRequest& request) { zero_.begin(request); }

  /// Handles a request for a calibration step. Drops a running step without an answer: the control server has answered
  /// it; its work goes on, and the new step waits for its end. A step other than kStiffness and kFinish ends an open
  /// request for a zero, which is answered with an error unless its zero has been taken. In turn, a zero that is taken
  /// or comes into force ends a step that looks at frames or waits for work to end, with an error. Returns at once; a
  /// later turn() answers, rarely this call.
  void beginStep(const CalibrationStep& step);

  /// Does what is due for zero, step and drift, and puts Watched. Must be called in each turn of the control loop. Does
  /// not wait, but a comparison of a zero with the gel file takes tens of milliseconds.
  void turn();

  /// Returns whether a step looks at frames, so that turn() should be called for every frame.
  bool hurried() const { return steps_.isLooking(); }

 private:
  void dropStep();
  void watchMarkers();
  void answerStep(const calibrate::Result& result);
  void measureRate();

  ProcedureOptions options_;
  ProcedureLinks links_;
  std::string camera_;  ///< empty: none yet
  std::string waits_;
  MarkerField markers_;
  calibrate::DriftWatch driftWatch_;
  calibrate::StepRunner steps_;
  zero::ZeroProcedure zero_;
  double rate_Hz_ = 0.0;          ///< 0: not known
  std::uint64_t framesThen_ = 0;  ///< number of frames ...
  std::int64_t then_ns_ = 0;      ///< ... at this moment; 0: none yet
  FrameWatch framesForStep_;
};

}  // namespace tractiond
