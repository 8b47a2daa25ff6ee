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
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace tractiond::publish {

/// Handlers of the requests. Called within serve(), on its thread. A request whose handler is empty is answered with an
/// error. Each of zero, calibrate, camera and snapshot must be answered once, by the function that its comment names,
/// at once or later, from the same thread; except a step of a calibration that another one has replaced.
struct ControlHandlers {
  std::function<std::string()> status = {};       ///< Returns Publisher::lastStatus().
  std::function<std::string()> description = {};  ///< Returns Publisher::lastDescription().
  /// Begins to take a zero, or to restore the one before: answerZero(). Equal requests for a zero that arrive meanwhile
  /// are not passed on and share the answer; others, and an undo, are answered with an error.
  std::function<void(const ZeroRequest&)> zero = {};
  /// Begins a step of a calibration: answerCalibration(). It replaces a step that has not been answered: the server has
  /// answered that one with an error.
  std::function<void(const CalibrationStep&)> calibrate = {};
  /// Begins a request for the camera: answerCamera(). Requests that arrive meanwhile are passed on after the answer.
  std::function<void(const CameraStep&)> camera = {};
  /// Requests the next picture: answerSnapshot(), later. Requests that arrive meanwhile share the answer.
  std::function<void()> snapshot = {};
  /// Receives a sentence for the log when answers could not be sent, at most once per second. May be empty. Also called
  /// within the functions that answer.
  std::function<void(const std::string&)> warn = {};
};

/// Thread-bound, except for unsent(). A request that is malformed or unknown is answered with an error or dropped. So
/// is a request for a zero, a picture or the camera for which 64 wait already. For a client that does not read, 16
/// answers wait, and further ones are lost. The connection of a client that sends a part of more than 64 KiB is ended.
/// An answer for which ZeroMQ has no memory is dropped, and counted (unsent()).
class ControlServer {
 public:
  /// Binds to ZeroMQ endpoints: "ipc://PATH", whose directory must exist, or "tcp://ADDRESS:PORT", where port * takes a
  /// free one. EX_CONFIG: an endpoint is malformed. EX_UNAVAILABLE: it is in use, or not an address of this machine.
  /// EX_CANTCREAT, EX_NOPERM: its file cannot be made. EX_OSERR: ZeroMQ cannot start.
  static tl::expected<std::unique_ptr<ControlServer>, Error> open(const std::vector<std::string>& endpoints,
                                                                  ControlHandlers handlers);
  ~ControlServer();  ///< Closes the socket and removes its files; clients that wait get no answer.

  /// Waits at most `timeout` for a request, and handles those that have arrived, a limited number in one call; the rest
  /// in the next one. Returns early when a signal arrives.
  void serve(std::chrono::milliseconds timeout);

  // The following have no effect if no client waits for the answer, and do not wait: the answer to a client that has
  // gone or does not read is dropped. An error is a sentence.

  /// Sends the zero, or the error, to all clients that wait for one. \param remark why it may be wrong; empty: no
  /// reason is known
  void answerZero(const tl::expected<RestPose, std::string>& result, const std::string& remark = "");

  /// Sends the result of the last step, or the error, to the client that requested it.
  void answerCalibration(const tl::expected<CalibrationReport, std::string>& result);

  /// Sends the camera's answer, or the error, to the client whose request was passed on last.
  void answerCamera(const tl::expected<CameraReport, std::string>& result);

  /// Sends the picture, or the error, to all clients that wait for one. Encodes it within the call, and halves it until
  /// it has at most 16 MiB. \param result a picture must fit (FrameCopy::fits), and need not outlive the call \param
  /// layers layers of its markers; empty: there are none
  void answerSnapshot(const tl::expected<const Snapshot*, std::string>& result,
                      const std::vector<sensor::MarkerLayer>& layers);

  /// Returns whether a zero or an undo was asked for and has not been answered, also if its client has gone.
  bool zeroPending() const;

  /// Returns the number of answers that were dropped because ZeroMQ had no memory for them. Any thread.
  std::uint64_t unsent() const;

  /// Returns the endpoints as they were bound.
  const std::vector<std::string>& endpoints() const;

 private:
  struct Impl;
  explicit ControlServer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tractiond::publish
