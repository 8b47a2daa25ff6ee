#include "traction/control.h"

#include "client/src/decode.h"
#include "client/src/locate.h"

#include <zmq.hpp>

#include <algorithm>
#include <filesystem>

namespace traction {

namespace {

/// A socket file that is not there would be waited for.
void expectSocket(const std::string& endpoint) {
  const std::string_view ipc = "ipc://";
  if (endpoint.rfind(ipc, 0) != 0 || endpoint.rfind("ipc://@", 0) == 0) return;
  std::error_code ignored;
  if (!std::filesystem::is_socket(endpoint.substr(ipc.size()), ignored)) {
    throw Error(ErrorCode::kNoAnswer, "nobody is at " + endpoint);
  }
}

std::string ask(const ControlOptions& options, const std::string& request, std::chrono::milliseconds timeout) {
  expectSocket(options.endpoint);
  zmq::context_t context(1);
  zmq::socket_t socket(context, zmq::socket_type::req);
  socket.set(zmq::sockopt::linger, 0);
  try {
    socket.connect(options.endpoint);
  } catch (const zmq::error_t& error) {
    throw Error(ErrorCode::kBadEndpoint, "cannot connect to '" + options.endpoint + "': " + error.what());
  }
  socket.send(zmq::buffer(request), zmq::send_flags::none);
  zmq_pollitem_t item{socket.handle(), 0, ZMQ_POLLIN, 0};
  zmq::message_t reply;
  if (zmq_poll(&item, 1, timeout.count()) <= 0 || zmq_msg_recv(reply.handle(), socket.handle(), ZMQ_DONTWAIT) < 0) {
    throw Error(ErrorCode::kNoAnswer, "nobody answers at " + options.endpoint);
  }
  return reply.to_string();
}

}  // namespace

Control::Control(const ControlOptions& options)
    : options_(options) {
  if (options_.endpoint.empty()) options_.endpoint = locate(options_.instance).back().control;
}

Status Control::status() const {
  return decodeStatusReply(ask(options_, encodeRequest(Request::kStatus), options_.timeout));
}

Description Control::description() const {
  return decodeDescriptionReply(ask(options_, encodeRequest(Request::kDescription), options_.timeout));
}

ZeroResult Control::zero() const {
  return decodeZeroReply(ask(options_, encodeRequest(Request::kZero), options_.zeroTimeout));
}

CalibrationReport Control::calibrate(const CalibrationStep& step) const {
  constexpr double kPatience_s = 60.0;  // the daemon's for a weight, where none is said
  const bool looks = step.kind == CalibrationStep::Kind::kWeight || step.kind == CalibrationStep::Kind::kNoise;
  const std::chrono::duration<double> time(looks ? std::max(step.seconds, kPatience_s) : 0.0);
  return decodeCalibrationReply(
      ask(options_, encodeCalibration(step),
          options_.workTimeout + std::chrono::duration_cast<std::chrono::milliseconds>(time)));
}

CameraReport Control::camera(const CameraStep& step) const {
  return decodeCameraReply(ask(options_, encodeCameraStep(step), options_.workTimeout));
}

}  // namespace traction
