#include "traction/control.h"

#include "client/src/deadline.h"
#include "client/src/decode_control.h"
#include "client/src/handshake.h"
#include "client/src/locate.h"
#include "client/src/messages.h"
#include "traction/v1/control.pb.h"
#include "traction/v1/status.pb.h"

#include <unistd.h>
#include <zmq.hpp>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <filesystem>
#include <span>
#include <tuple>

namespace traction {

namespace {

constexpr double kLongestZero_s = 1e6;                       // limit on the time that a daemon reports
constexpr std::chrono::duration<double> kLongestWait(1e12);  // what milliseconds can hold, and more than anyone waits

/// Throws kNoAnswer if the socket file of an ipc endpoint does not exist or may not be written: ZeroMQ would wait for
/// it.
void expectSocket(const std::string& endpoint) {
  const std::string_view ipc = "ipc://";
  if (endpoint.rfind(ipc, 0) != 0 || endpoint.rfind("ipc://@", 0) == 0) return;
  std::error_code ignored;
  const std::string path = endpoint.substr(ipc.size());
  if (access(path.c_str(), W_OK) != 0 && errno == EACCES) {
    throw Error(ErrorCode::kNoAnswer, "you may not ask at " + endpoint +
                                          ": only the user that tractiond runs as and its group may (usermod --append "
                                          "--groups tractiond USER)");
  }
  if (!std::filesystem::is_socket(path, ignored)) {
    throw Error(ErrorCode::kNoAnswer, "nothing answers at " + endpoint + "; is tractiond running?");
  }
}

/// Returns the monitor's next event; (0, 0) if there is none.
std::pair<std::uint16_t, std::uint32_t> nextEvent(zmq::socket_t& monitor) {
  zmq::message_t event, address;
  zmq_msg_recv(event.handle(), monitor.handle(), ZMQ_DONTWAIT);
  zmq_msg_recv(address.handle(), monitor.handle(), ZMQ_DONTWAIT);
  return eventOf(event);
}

/// Waits until one of the sockets has something, at most until `end`; handlers of signals do not end it. Returns
/// whether one has something.
bool await(std::span<zmq_pollitem_t> items, std::chrono::steady_clock::time_point end) {
  for (;;) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - std::chrono::steady_clock::now());
    const int ready = zmq_poll(items.data(), static_cast<int>(items.size()), std::max<long>(left.count(), 0));
    if (ready >= 0 || zmq_errno() != EINTR) return ready > 0;
  }
}

/// Waits until the handshake with a peer succeeds, for at most options.timeout.
/// \throws Error kNoAnswer, kNotAllowed
void expectPeer(zmq::socket_t& monitor, const ControlOptions& options) {
  const auto end = endAfter(options.timeout);
  bool isSomebody = false;
  Handshake handshake(options.endpoint, !options.keys.serverKey.empty());
  for (;;) {
    zmq_pollitem_t item{monitor.handle(), 0, ZMQ_POLLIN, 0};
    if (!await({&item, 1}, end)) break;
    const auto [what, value] = nextEvent(monitor);
    if (what == ZMQ_EVENT_HANDSHAKE_SUCCEEDED) return;
    if (const auto refused = handshake.process(what, value)) throw *refused;
    isSomebody = isSomebody || what == ZMQ_EVENT_DISCONNECTED;  // disconnected before the handshake
  }
  throw Error(ErrorCode::kNoAnswer,
              isSomebody
                  ? "who is at " + options.endpoint +
                        " takes no requests; is it the endpoint 'control' of a tractiond? A gateway asks for a key"
                  : "nothing answers at " + options.endpoint + "; is tractiond running?");
}

/// Waits for the reply.
/// \throws Error kNoAnswer if it does not arrive in time or the peer disconnects first
std::string awaitReply(zmq::socket_t& socket, zmq::socket_t& monitor, const std::string& endpoint,
                       std::chrono::milliseconds timeout) {
  const auto end = endAfter(timeout);
  zmq::message_t reply;
  for (bool isGone = false;;) {
    std::array<zmq_pollitem_t, 2> items = {{{socket.handle(), 0, ZMQ_POLLIN, 0}, {monitor.handle(), 0, ZMQ_POLLIN, 0}}};
    if (!await(items, isGone ? std::chrono::steady_clock::time_point{} : end)) {
      if (isGone) throw Error(ErrorCode::kNoAnswer, "who was asked at " + endpoint + " has gone before the answer");
      break;
    }
    if (items[0].revents != 0 && zmq_msg_recv(reply.handle(), socket.handle(), ZMQ_DONTWAIT) >= 0)
      return reply.to_string();
    if (items[1].revents != 0) isGone = isGone || nextEvent(monitor).first == ZMQ_EVENT_DISCONNECTED;
  }
  throw Error(ErrorCode::kNoAnswer, "somebody is at " + endpoint + ", but has not answered within " +
                                        std::to_string(std::lround(std::chrono::duration<double>(timeout).count())) +
                                        " s; a tractiond that computes the factors of a new gel answers later");
}

constexpr std::int64_t kLargestReply_bytes = 128 << 20;  // a picture of 40 million pixels of 24 bits

/// Connects, sends a request and returns the reply's bytes.
/// \param timeout for the reply, once connected
std::string send(const ControlOptions& options, pb::Request message, std::chrono::milliseconds timeout) try {
  message.set_version(kControlVersion);
  const std::string request = message.SerializeAsString();
  constexpr const char* kMonitor = "inproc://monitor";
  expectSocket(options.endpoint);
  zmq::context_t context(1);
  zmq::socket_t socket(context, zmq::socket_type::req);
  zmq::socket_t monitor(context, zmq::socket_type::pair);
  socket.set(zmq::sockopt::linger, 0);
  socket.set(zmq::sockopt::maxmsgsize, kLargestReply_bytes);
  useKeys(socket, options.keys);
  zmq_socket_monitor(socket.handle(), kMonitor, kHandshakeEvents | ZMQ_EVENT_DISCONNECTED);
  monitor.connect(kMonitor);
  try {
    socket.connect(options.endpoint);
  } catch (const zmq::error_t& error) {
    throw badEndpoint(options.endpoint, error.what());
  }
  expectPeer(monitor, options);
  while (zmq_send(socket.handle(), request.data(), request.size(), 0) < 0) {
    if (zmq_errno() != EINTR) throw zmq::error_t();
  }
  return awaitReply(socket, monitor, options.endpoint, timeout);
} catch (const zmq::error_t& error) {
  throw noConnection(options.endpoint, error);
}

/// The same, and returns the reply, which answers `expected`.
pb::Reply ask(const ControlOptions& options, const pb::Request& request, pb::Reply::ReplyCase expected,
              std::chrono::milliseconds timeout) {
  return replyOf(send(options, request, timeout), expected);
}

}  // namespace

Control::Control(const ControlOptions& options)
    : options_(options) {
  std::ignore = endpoint();  // throws what a request would
}

std::string Control::endpoint() const {
  return options_.endpoint.empty() ? locate(options_.instance).back().control : options_.endpoint;
}

ControlOptions Control::located() const {
  ControlOptions options = options_;
  options.endpoint = endpoint();
  return options;
}

Status Control::status() const {
  return statusOf(replyOf(pass(Question::kStatus), pb::Reply::kStatus).status());
}

Description Control::description() const {
  return descriptionOf(replyOf(pass(Question::kDescription), pb::Reply::kDescription).description());
}

ZeroResult Control::zero(const ZeroOptions& options) const {
  pb::Request request;
  request.mutable_zero()->set_anyway(options.anyway);
  return resultOf(ask(located(), request, pb::Reply::kZero, zeroTakes()).zero());
}

ZeroResult Control::undoZero() const {
  return resultOf(replyOf(pass(Question::kUndoZero), pb::Reply::kZero).zero());
}

std::string Control::pass(Question question) const {
  pb::Request request;
  switch (question) {
  case Question::kStatus:
    request.mutable_status();
    break;
  case Question::kDescription:
    request.mutable_description();
    break;
  case Question::kZero:
  case Question::kUndoZero:
    request.mutable_zero()->set_undo(question == Question::kUndoZero);
    return send(located(), request, zeroTakes());
  }
  return send(located(), request, options_.timeout);
}

/// Returns how long a zero takes at most: a daemon may average over thousands of frames, and its disk may be slow.
std::chrono::milliseconds Control::zeroTakes() const {
  constexpr std::chrono::duration<double> kOnTheWay(2.0);
  try {
    const std::chrono::duration<double> within(std::clamp(status()->zero_within_s(), 0.0, kLongestZero_s));
    return std::max(options_.zeroTimeout, std::chrono::duration_cast<std::chrono::milliseconds>(within + kOnTheWay));
  } catch (const Error&) {  // the zero request itself reports the error
    return options_.zeroTimeout;
  }
}

Snapshot Control::snapshot() const {
  pb::Request request;
  request.mutable_snapshot();
  return snapshotOf(ask(located(), request, pb::Reply::kSnapshot, options_.zeroTimeout).snapshot());
}

CalibrationReport Control::calibrate(const CalibrationStep& step) const {
  if (!std::isfinite(step.seconds)) throw Error(ErrorCode::kRefused, "the seconds of a step must be finite");
  const std::chrono::duration<double> time = std::chrono::duration<double>(options_.calibrationTimeout) +
                                             std::chrono::duration<double>(std::max(step.seconds, 0.0));
  pb::Request request;
  *request.mutable_calibrate() = requestOf(step);
  const auto timeout = std::chrono::duration_cast<std::chrono::milliseconds>(std::min(time, kLongestWait));
  return reportOf(ask(located(), request, pb::Reply::kCalibrate, timeout).calibrate());
}

void Control::adopt(const std::string& gelFile) const {
  pb::Request request;
  request.mutable_adopt()->set_gel_file(gelFile);
  ask(located(), request, pb::Reply::kAdopt, options_.workTimeout);
}

CameraReport Control::camera(const CameraStep& step) const {
  pb::Request request;
  *request.mutable_camera() = requestOf(step);
  return reportOf(ask(located(), request, pb::Reply::kCamera, options_.workTimeout).camera());
}

}  // namespace traction
