// Handles requests for zeros and calibration steps, and measures the drift of the zero.
#pragma once

#include "daemon/calibrate/zero_tracking.h"
#include "daemon/control/procedure_parts.h"
#include "daemon/control/step_runner.h"
#include "daemon/control/zero_procedure.h"
#include "daemon/records/frame_watch.h"

#include <optional>
#include <string>

namespace tractiond::control {

/// Answers each request once: a zero within Watched::zeroWithin_s, if the disk takes no longer than that allows; a
/// calibration step within its seconds and Calibration::kGrace_s plus twice ZeroProcedure::kNoFrames_ns, and what its
/// computations and the disk take. A request for a zero that was answered with an error changes nothing later. Bound to
/// the control thread.
class Procedures {
 public:
  /// Reserves the memory of ProcedureParts::markers by a put() and a take(): must be made before another thread uses
  /// that mailbox, on any thread.
  Procedures(const ProcedureParts& parts, const ProcedureOptions& options);

  /// Takes over the camera and the zeros of an earlier run; see ZeroProcedure::restore(). Must be called once, when the
  /// camera has been opened for the first time.
  /// \param camera sensor::MeasuredWith::text()
  /// \param rate_Hz of its frames, until it is measured; 0: not known
  /// \param restored the zero of an earlier run, if there is one
  /// \param before the zero that it replaced, if there is one
  void restore(const std::string& camera, double rate_Hz, const std::optional<RestPose>& restored,
               const std::optional<RestPose>& before = {});

  /// Sets what the camera of a new session waits for (CameraInfo::waits()), for answers that no frames come.
  void setWaits(const std::string& waits) { zero_.setWaits(waits); }

  /// Returns what handles requests for zeros.
  ZeroProcedure& zero() { return zero_; }

  /// Handles a request for a calibration step. Drops a running step without an answer: the control server has answered
  /// it; while its work goes on, the new step is refused. A step other than kStiffness and kFinish ends an open
  /// request for a zero, which is answered with an error unless its zero has been taken. In turn, a zero that is taken
  /// or comes into force ends a step that looks at frames, with an error. Returns at once; a later turn() answers,
  /// or this call.
  void beginStep(const CalibrationStep& step);

  /// Does what is due for zero, step and drift, and puts Watched. Must be called in each turn of the control loop. Does
  /// not wait, but a comparison of a zero with the gel file takes tens of milliseconds.
  void turn();

  /// Returns whether a step looks at frames, so that turn() should be called for every frame.
  bool hurried() const { return steps_.isLooking(); }

 private:
  void watchMarkers();
  void measureRate();

  const ProcedureParts parts_;
  const ProcedureOptions options_;
  std::string camera_;  ///< empty: none yet
  MarkerField markers_;
  calibrate::DriftWarning driftWarning_;
  StepRunner steps_;
  ZeroProcedure zero_;
  double rate_Hz_ = 0.0;          ///< 0: not known
  std::uint64_t framesThen_ = 0;  ///< number of frames ...
  std::int64_t then_ns_ = 0;      ///< ... at this moment; 0: none yet
  FrameWatch framesForStep_;
};

}  // namespace tractiond::control
