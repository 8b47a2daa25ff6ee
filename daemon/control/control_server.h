// Answers requests: status, description, zero, calibration, the camera's features, a picture.
#pragma once

#include "base/error.h"
#include "daemon/control/requests.h"
#include "daemon/publish/newest_messages.h"
#include "daemon/records/camera_features.h"
#include "sensor/measured_with.h"

#include <tl/expected.hpp>

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace tractiond::control {

/// Thread-bound. A request that is malformed or unknown is answered with an error or dropped. For a client that does
/// not read, 16 answers wait, and further ones are lost. The connection of a client that sends a part of more than 64
/// KiB is ended.
class ControlServer final : public Replies {
 public:
  /// Binds to ZeroMQ endpoints: "ipc://PATH", whose directory must exist, or "tcp://ADDRESS:PORT", where port * takes a
  /// free one. EX_CONFIG: an endpoint is malformed. EX_UNAVAILABLE: it is in use, or not an address of this machine.
  /// EX_CANTCREAT, EX_NOPERM: its file cannot be made. EX_OSERR: ZeroMQ cannot start.
  /// \param published answers requests for status and description; outlives this
  static tl::expected<std::unique_ptr<ControlServer>, Error> open(const std::vector<std::string>& endpoints,
                                                                  const publish::NewestMessages& published);
  ~ControlServer();  ///< Closes the socket and removes its files; clients that wait get no answer.

  /// Waits at most `timeout` for a request, and handles those that have arrived, a limited number in one call; the rest
  /// in the next one. Returns early when a signal arrives. Equal requests for a zero that arrive while one is not
  /// answered are not passed on and share the answer; others, and an undo, are answered with an error. A step of a
  /// calibration that has not been answered is answered with an error when another one arrives. Requests for a picture
  /// that arrive while one is not answered share the answer.
  void serve(std::chrono::milliseconds timeout, Requests& requests);

  /// Returns the next request for the camera, once, when all before it are answered by answerCamera(); nothing: there
  /// is none, or the camera is being asked.
  std::optional<CameraStep> takeCameraStep();

  /// Returns the text of a gel file that a client asks to adopt, once; nothing: there is none. Another request before
  /// answerAdoption() is answered with an error.
  std::optional<std::string> takeGelFile();

  // The following have no effect if no client waits for the answer, and do not wait: the answer to a client that has
  // gone or does not read is dropped. An error is a sentence.

  /// Sends the zero, or the error, to all clients that wait for one.
  void answerZero(const tl::expected<RestPose, std::string>& result, const std::string& remark = "") override;

  /// Sends the result of the last step, or the error, to the client that requested it.
  void answerCalibration(const tl::expected<CalibrationReport, std::string>& result) override;

  /// Sends the camera's answer, or the error, to the client of the last takeCameraStep().
  void answerCamera(const tl::expected<CameraReport, std::string>& result);

  /// Tells the client of the last takeGelFile() that its gel file is kept, or the error.
  void answerAdoption(const tl::expected<void, std::string>& result);

  /// Sets what pictures state to be of, from now on.
  void setCamera(sensor::MeasuredWith camera);

  /// Sends the picture, or the error, to all clients that wait for one. Encodes it within the call, and halves it until
  /// it has at most 16 MiB.
  void answerSnapshot(const tl::expected<const Snapshot*, std::string>& result,
                      const std::vector<sensor::MarkerLayer>& layers) override;

  /// Returns the endpoints as they were bound.
  const std::vector<std::string>& endpoints() const;

 private:
  struct Impl;
  explicit ControlServer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tractiond::control
