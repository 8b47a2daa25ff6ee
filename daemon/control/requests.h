// Interfaces between the control server and what handles its requests.
#pragma once

#include "daemon/records/calibration.h"
#include "daemon/records/marker_field.h"
#include "daemon/records/snapshot.h"
#include "daemon/records/zero_request.h"
#include "sensor/sensor.h"

#include <tl/expected.hpp>

#include <string>
#include <vector>

namespace tractiond::control {

/// Returns why a request fails if no frames come.
/// \param waits what the camera waits for; may be empty
inline std::string noFrames(const std::string& waits) {
  return "no frames come from the camera" + (waits.empty() ? "" : ": " + waits);
}

/// Handles requests that are answered later, each once, through Replies. All functions are called on the control
/// thread.
class Requests {
 public:
  /// Begins to take a zero, or to restore the one before: Replies::answerZero(). Must not be called while an earlier
  /// zero is not answered.
  virtual void beginZero(const ZeroRequest& request) = 0;
  /// Begins a step of a calibration: Replies::answerCalibration(). It replaces a step that has not been answered, which
  /// then gets no answer here.
  virtual void beginStep(const CalibrationStep& step) = 0;
  /// Requests the next picture: Replies::answerSnapshot(). Must not be called while an earlier one is not answered.
  virtual void askSnapshot() = 0;

 protected:
  ~Requests() = default;
};

/// Answers requests. All functions are called on the control thread, and do not wait. An error is a sentence for the
/// client.
class Replies {
 public:
  /// \param remark why the zero may be wrong; empty: no reason is known
  virtual void answerZero(const tl::expected<RestPose, std::string>& result, const std::string& remark = "") = 0;
  virtual void answerCalibration(const tl::expected<CalibrationReport, std::string>& result) = 0;
  /// \param result a picture must fit (FrameCopy::fits), and need not outlive the call
  /// \param layers layers of its markers; empty: there are none
  virtual void answerSnapshot(const tl::expected<const Snapshot*, std::string>& result,
                              const std::vector<sensor::MarkerLayer>& layers) = 0;

 protected:
  ~Replies() = default;
};

}  // namespace tractiond::control
