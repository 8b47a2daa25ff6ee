#include "daemon/control/control_server.h"

#include "base/network/socket.h"
#include "daemon/publish/wire_control.h"

#include <array>
#include <deque>
#include <optional>

namespace tractiond::control {

namespace {

constexpr std::int64_t kLargestRequest = 65'536;
constexpr int kWaitingReplies = 16;  ///< per peer; one that does not read loses the rest
constexpr int kRequestsPerTurn = 64;

}  // namespace

struct ControlServer::Impl {
  /// Back to the client.
  struct Route {
    std::string peer;
    std::string beyond;  ///< behind a peer that passes requests on; empty: the peer itself
  };

  explicit Impl(const publish::NewestMessages& newest)
      : published(newest) {}
  ~Impl() { network::release(endpoints); }

  void reply(const Route& route, const std::string& bytes) { replyAll({route}, bytes); }
  void reply(const std::optional<Route>& route, const std::string& bytes) {
    if (route) reply(*route, bytes);
  }

  /// One message is shared by all.
  void replyAll(const std::vector<Route>& routes, const std::string& bytes) {
    if (routes.empty()) return;
    zmq::message_t message(bytes.data(), bytes.size());
    for (const Route& route : routes) {
      zmq::message_t peer(route.peer.data(), route.peer.size()), beyond(route.beyond.data(), route.beyond.size());
      zmq::message_t empty, shared;
      shared.copy(message);
      // ROUTER drops what is for a peer that has gone or does not read.
      network::put(socket, peer, true);
      if (!route.beyond.empty()) network::put(socket, beyond, true);
      network::put(socket, empty, true);
      network::put(socket, shared, false);
    }
  }

  /// \param parts number of parts of `request`
  void answer(std::size_t parts, Requests& requests) {
    // [peer][empty][request], or [peer][beyond][empty][request]; a peer that does not speak REQ's envelope would not
    // understand a reply either.
    const bool passedOn = parts == 4 && !request[1].empty();
    const std::size_t last = passedOn ? 3 : 2;
    if (parts != last + 1 || !request[last - 1].empty()) return;
    zmq::message_t& message = request[last];
    const std::string name = network::peerName(message);
    const Route peer{request[0].to_string(), passedOn ? request[1].to_string() : ""};
    auto asked = publish::decodeRequest(message.to_string_view());
    if (!asked) return reply(peer, publish::encodeErrorReply(asked.error()));
    switch (asked->request) {
    case publish::Request::kStatus:
      return reply(peer, publish::encodeReply(asked->request, published.lastStatus()));
    case publish::Request::kDescription:
      return reply(peer, publish::encodeReply(asked->request, published.lastDescription()));
    case publish::Request::kCalibrate:
      reply(calibrator, publish::encodeErrorReply("another step of the calibration was asked for"));
      calibrator = peer;
      return requests.beginStep(asked->calibration);
    case publish::Request::kSnapshot:
      snapshotAskers.push_back(peer);
      if (snapshotAskers.size() == 1) requests.askSnapshot();
      return;
    case publish::Request::kCamera:
      return cameraAskers.push_back({peer, std::move(asked->camera)});
    case publish::Request::kAdopt:
      if (adopter) return reply(peer, publish::encodeErrorReply("another gel file is being adopted"));
      adopter = peer;
      gelFile = std::move(asked->gelFile);
      return;
    case publish::Request::kZero:
      asked->zero.asker = name;
      if (!asked->onBehalfOf.empty()) asked->zero.asker = asked->onBehalfOf + " through " + asked->zero.asker;
      return askZero(peer, asked->zero, requests);
    }
  }

  void askZero(const Route& peer, const ZeroRequest& wanted, Requests& requests) {
    const bool first = zeroAskers.empty();
    if (!first && (wanted.undo || wanted.anyway != zeroAsked.anyway)) {
      return reply(peer, publish::encodeErrorReply("a zero is being taken; ask again"));
    }
    zeroAskers.push_back(peer);
    if (!first) return;
    zeroAsked = wanted;
    requests.beginZero(wanted);
  }

  struct CameraAsker {
    Route peer;
    CameraStep step;
  };

  const publish::NewestMessages& published;
  std::array<zmq::message_t, 4> request;
  std::vector<Route> zeroAskers;
  ZeroRequest zeroAsked;  ///< by the first of them
  std::vector<Route> snapshotAskers;
  std::optional<Route> calibrator;       ///< waits for the step that runs
  std::deque<CameraAsker> cameraAskers;  ///< the first is asked for, if any is
  bool cameraAsked = false;
  sensor::MeasuredWith camera;         ///< of pictures
  std::optional<Route> adopter;        ///< waits until its gel file is kept
  std::optional<std::string> gelFile;  ///< that is to be adopted, until it is taken
  zmq::context_t context{1};  ///< its own: what peers send here does not keep the publisher's thread from sending
  zmq::socket_t socket{context, zmq::socket_type::router};
  std::vector<std::string> endpoints;
};

ControlServer::ControlServer(std::unique_ptr<Impl> impl)
    : impl_(std::move(impl)) {}

ControlServer::~ControlServer() = default;

tl::expected<std::unique_ptr<ControlServer>, Error> ControlServer::open(const std::vector<std::string>& endpoints,
                                                                        const publish::NewestMessages& published) try {
  auto impl = std::make_unique<Impl>(published);
  network::guard(impl->socket, kWaitingReplies, kLargestRequest);
  auto bound = network::bind(impl->socket, endpoints);
  if (!bound) return tl::unexpected(bound.error());
  impl->endpoints = *std::move(bound);
  return std::unique_ptr<ControlServer>(new ControlServer(std::move(impl)));
} catch (const zmq::error_t& error) {
  return tl::unexpected(Error{EX_OSERR, std::string("ZeroMQ cannot start: ") + error.what(), "", ""});
}

void ControlServer::serve(std::chrono::milliseconds timeout, Requests& requests) {
  zmq_pollitem_t item = network::readable(impl_->socket);
  zmq_poll(&item, 1, timeout.count());
  for (int i = 0; i < kRequestsPerTurn; ++i) {
    const std::size_t parts = network::receive(impl_->socket, impl_->request);
    if (parts == 0) return;
    impl_->answer(parts, requests);
  }
}

std::optional<CameraStep> ControlServer::takeCameraStep() {
  if (impl_->cameraAsked || impl_->cameraAskers.empty()) return std::nullopt;
  impl_->cameraAsked = true;
  return impl_->cameraAskers.front().step;
}

std::optional<std::string> ControlServer::takeGelFile() {
  return std::exchange(impl_->gelFile, std::nullopt);
}

void ControlServer::answerAdoption(const tl::expected<void, std::string>& result) {
  impl_->reply(std::exchange(impl_->adopter, std::nullopt),
               result ? publish::encodeAdoptReply() : publish::encodeErrorReply(result.error()));
}

void ControlServer::answerZero(const tl::expected<RestPose, std::string>& result, const std::string& remark) {
  impl_->replyAll(std::exchange(impl_->zeroAskers, {}),
                  result ? publish::encodeZeroReply(*result, remark) : publish::encodeErrorReply(result.error()));
}

void ControlServer::answerCalibration(const tl::expected<CalibrationReport, std::string>& result) {
  impl_->reply(std::exchange(impl_->calibrator, std::nullopt),
               result ? publish::encodeCalibrationReply(*result) : publish::encodeErrorReply(result.error()));
}

void ControlServer::answerCamera(const tl::expected<CameraReport, std::string>& result) {
  if (!std::exchange(impl_->cameraAsked, false)) return;
  const Impl::Route peer = std::move(impl_->cameraAskers.front().peer);
  impl_->cameraAskers.pop_front();
  impl_->reply(peer, result ? publish::encodeCameraReply(*result) : publish::encodeErrorReply(result.error()));
}

void ControlServer::setCamera(sensor::MeasuredWith camera) {
  impl_->camera = std::move(camera);
}

void ControlServer::answerSnapshot(const tl::expected<const Snapshot*, std::string>& result,
                                   const std::vector<sensor::MarkerLayer>& layers) {
  const auto askers = std::exchange(impl_->snapshotAskers, {});
  if (askers.empty()) return;
  impl_->replyAll(askers, result ? publish::encodeSnapshotReply(**result, layers, impl_->camera)
                                 : publish::encodeErrorReply(result.error()));
}

const std::vector<std::string>& ControlServer::endpoints() const {
  return impl_->endpoints;
}

}  // namespace tractiond::control
