// Answers requests: status, description, zero, calibration, the camera's features, a picture.
#pragma once

#include "base/error.h"
#include "daemon/records/calibration.h"
#include "daemon/records/camera_features.h"
#include "daemon/records/marker_field.h"
#include "daemon/records/snapshot.h"
#include "daemon/records/zero_request.h"
#include "sensor/sensor.h"

#include <tl/expected.hpp>

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace tractiond::publish {

/// Called within serve(), on its thread.
struct ControlHandlers {
  std::function<std::string()> status;       ///< Publisher::lastStatus
  std::function<std::string()> description;  ///< Publisher::lastDescription
  /// Begin to take a zero, or put the one before back. What came of it is told with answerZero(), at once or later;
  /// who asks for the same meanwhile is not passed on and shares the answer.
  std::function<void(const ZeroRequest&)> zero;
  /// Begin a step. What came of it is told with answerCalibration(), at once or later.
  std::function<void(const CalibrationStep&)> calibrate = {};
  /// Begin what is asked of the camera. What came of it is told with answerCamera(), at once or later; what is asked
  /// meanwhile is passed on then.
  std::function<void(const CameraStep&)> camera = {};
  /// Get the next picture. It is told with answerSnapshot(), later; further askers meanwhile share the answer.
  std::function<void()> snapshot = {};
};

/// Thread-bound. A request that is malformed, too large (64 KiB) or unknown is answered with an error or dropped.
class ControlServer {
 public:
  /// Endpoints as for the publisher.
  static tl::expected<std::unique_ptr<ControlServer>, Error> open(const std::vector<std::string>& endpoints,
                                                                  ControlHandlers handlers);
  ~ControlServer();

  /// Waits at most `timeout` for a request, and answers what has come.
  void serve(std::chrono::milliseconds timeout);

  /// The rest pose, or a sentence why there is none, for all who asked.
  void answerZero(const tl::expected<RestPose, std::string>& result, const std::string& remark = "");

  /// What came of the last step, for whoever asked for it.
  void answerCalibration(const tl::expected<CalibrationReport, std::string>& result);

  /// What came of what was asked of the camera last.
  void answerCamera(const tl::expected<CameraReport, std::string>& result);

  /// The picture, or a sentence why there is none, for all who asked. \param layers of its markers
  void answerSnapshot(const tl::expected<const Snapshot*, std::string>& result,
                      const std::vector<sensor::MarkerLayer>& layers);

  /// Somebody waits for answerZero().
  bool zeroPending() const;

  /// As bound.
  const std::vector<std::string>& endpoints() const;

 private:
  struct Impl;
  explicit ControlServer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tractiond::publish
