// Runs the steps of a calibration, one at a time. Work that takes seconds or waits for a disk (a fit, the gel's
// mechanics, the file) is done on another thread, so that the control loop goes on.
#pragma once

#include "daemon/control/procedure_parts.h"

#include <future>
#include <optional>
#include <string>

namespace tractiond::control {

/// Answers each step once, unless another one is requested before. Work that is under way cannot be stopped: what it
/// has measured or written counts, also if its step was answered with an error. Must not be destroyed meanwhile.
/// Thread-bound.
class StepRunner {
 public:
  StepRunner(const ProcedureParts& parts, const ProcedureOptions& options);

  /// Begins a step; returns at once, and may answer before. It replaces a step that looks at frames, which is dropped
  /// without an answer. While work is under way it waits for the end of that, whose step gets no answer. Parameters are
  /// those of calibrate::Calibration::begin(); all are copied.
  void begin(const CalibrationStep& step, const std::optional<RestPose>& zero, const std::string& camera);

  /// Ends a step that looks at frames, or is going to, with this error. A step that ends without frames is answered as
  /// usual. Has no effect without a step.
  /// \param reason sentence for the client
  void drop(const std::string& reason);

  /// Gives a frame to the calibration; answers the step if it ends with that. A frame that comes while work is under
  /// way is dropped.
  void add(const MarkerField& field);

  /// Handles the end of background work: answers its request, or gives frames to its step. Does not wait. Must be
  /// called in each turn of the control loop.
  void turn();

  /// Returns whether a step looks at frames now: not while work is under way.
  bool isLooking() const { return !work_ && calibration_.running(); }

 private:
  struct UnderWay {
    std::future<std::optional<calibrate::Result>> done = {};
    bool isAwaited = true;        ///< false: its request has been answered
    std::string dropReason = {};  ///< the answer if the step would look at frames; empty: it may
  };

  struct Begin {
    CalibrationStep step;
    std::optional<RestPose> zero;
    std::string camera;
  };

  void start(Begin begin);
  void run(StepWork work);
  void answer(const calibrate::Result& result);

  const ProcedureParts parts_;
  const ProcedureOptions options_;
  calibrate::Calibration calibration_;  ///< used by the other thread while work_ is under way
  std::optional<UnderWay> work_;
  std::optional<Begin> waiting_;  ///< for the end of work_
};

}  // namespace tractiond::control
