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

/// Handlers of the requests. Called within serve(), on its thread. Each of the last four must be answered once, by the
/// function that its comment names, at once or later.
struct ControlHandlers {
  std::function<std::string()> status;       ///< Returns Publisher::lastStatus().
  std::function<std::string()> description;  ///< Returns Publisher::lastDescription().
  /// Begins to take a zero, or to restore the one before: answerZero(). Equal requests that arrive meanwhile are not
  /// passed on and share the answer.
  std::function<void(const ZeroRequest&)> zero;
  /// Begins a step of a calibration: answerCalibration().
  std::function<void(const CalibrationStep&)> calibrate = {};
  /// Begins a request for the camera: answerCamera(). Requests that arrive meanwhile are passed on after the answer.
  std::function<void(const CameraStep&)> camera = {};
  /// Requests the next picture: answerSnapshot(), later. Requests that arrive meanwhile share the answer.
  std::function<void()> snapshot = {};
};

/// Thread-bound. A request that is malformed, too large (64 KiB) or unknown is answered with an error or dropped.
class ControlServer {
 public:
  /// Binds to the endpoints, whose form is that of PublishOptions::stream. Fails if one cannot be bound.
  static tl::expected<std::unique_ptr<ControlServer>, Error> open(const std::vector<std::string>& endpoints,
                                                                  ControlHandlers handlers);
  ~ControlServer();

  /// Waits at most `timeout` for a request, and handles all that have arrived.
  void serve(std::chrono::milliseconds timeout);

  // The following have no effect if no client waits for the answer. An error is a sentence.

  /// Sends the zero to all clients that wait for one. \param remark why it may be wrong; empty: no reason is known
  void answerZero(const tl::expected<RestPose, std::string>& result, const std::string& remark = "");

  /// Sends the result of the last step to the client that requested it.
  void answerCalibration(const tl::expected<CalibrationReport, std::string>& result);

  /// Sends the camera's answer to the client whose request was passed on last.
  void answerCamera(const tl::expected<CameraReport, std::string>& result);

  /// Sends the picture to all clients that wait for one. \param layers layers of its markers
  void answerSnapshot(const tl::expected<const Snapshot*, std::string>& result,
                      const std::vector<sensor::MarkerLayer>& layers);

  /// Returns whether a client waits for answerZero().
  bool zeroPending() const;

  /// Returns the endpoints as they were bound.
  const std::vector<std::string>& endpoints() const;

 private:
  struct Impl;
  explicit ControlServer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tractiond::publish
