#include "tests/simulation/driver.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace tractiond::simulation {
namespace {

constexpr const char* kAddress = "192.0.2.1";
constexpr std::int64_t kRepeats_ns = 3 * kSecond;  // Aravis does, each question

/// Spends the time until the camera answers. Returns false if it does not within `patience_ns`.
bool ask(const Camera& camera, std::int64_t patience_ns) {
  spent_ns() += std::min(camera.answersAfter_ns(), patience_ns);
  return camera.answersAfter_ns() <= patience_ns;
}

class SimulatedDriver : public capture::Driver {
 public:
  SimulatedDriver(Connection& connection, std::int64_t streamsFrom_ns)
      : connection_(connection) {
    info_.name.id = kCamera;
    info_.name.vendor = "Simulated";
    info_.name.serial = "1";
    info_.shape = connection.camera.shape();
    info_.frameRate_Hz = 60.0;
    ++connection.open;
    ++connection.opened;
    connection.camera.connect(streamsFrom_ns, now() + spent_ns());
  }
  ~SimulatedDriver() override {
    --connection_.open;
    connection_.camera.disconnect();
  }
  const capture::CameraInfo& info() const override { return info_; }
  capture::Popped pop(capture::Buffer& buffer, std::chrono::milliseconds timeout) override {
    Camera& camera = connection_.camera;
    connection_.isPopped = true;
    connection_.popWaits = timeout;
    OnItsWay come;
    do {
      if (camera.arrives_ns() > now()) return capture::Popped::kNothing;
      come = camera.take();
    } while (throwsAway(come));
    comesTwice_ = comesTwice_ || camera.comesTwice(come);
    Picture& room = connection_.pictures[connection_.nextPicture++ % Connection::kPictures] = come.picture;
    room.at_ns = come.at_ns;
    buffer.arrival = come.arrival;
    buffer.arrival.thrown = std::exchange(thrown_, 0);
    buffer.arrival.duplicated = std::exchange(comesTwice_, false);
    buffer.arrival.host_ns = buffer.arrival.raw_ns = now();
    buffer.data = room.bytes.data();
    buffer.handle = &room;
    buffer.awaited = !camera.hasMore();
    return capture::Popped::kBuffer;
  }
  void giveBack(void* /*handle*/) override {}
  Discard discard() const override {
    return [](void*) {};
  }
  std::string doubt() override {
    constexpr std::int64_t kPatience_ns = 130 * kMs;
    return ask(connection_.camera, kPatience_ns) ? "" : "it does not answer";
  }
  CameraLink link(const CameraLink& /*before*/) override {
    ask(connection_.camera, kRepeats_ns);
    return {};
  }
  tl::expected<CameraReport, std::string> serve(const CameraStep& /*step*/) override {
    if (ask(connection_.camera, kRepeats_ns)) return CameraReport{};
    return tl::unexpected<std::string>("the camera does not answer");
  }

 private:
  /// Frames that are up to a hundred older than the newest Aravis takes for late, and throws away; packets of the
  /// newest it counts as come twice while that is being received.
  bool throwsAway(const OnItsWay& come) {
    constexpr int kLate = 100;
    const int ahead = static_cast<std::int16_t>(static_cast<std::uint16_t>(come.arrival.id - newestId_));
    if (newestId_ != 0 && ahead == 0 && come.at_ns - newestAt_ns_ < kFrame_ns) {
      return comesTwice_ = true;
    }
    if (newestId_ != 0 && ahead <= 0 && ahead > -kLate) return ++thrown_ > 0;
    newestId_ = come.arrival.id;
    newestAt_ns_ = come.at_ns;
    return false;
  }

  Connection& connection_;
  capture::CameraInfo info_;
  std::uint64_t newestId_ = 0, thrown_ = 0;  ///< 0: none has come
  std::int64_t newestAt_ns_ = 0;
  bool comesTwice_ = false;  ///< packets, since the last picture
};

tl::unexpected<Error> refused(int code, std::string what, std::string remedy = {}) {
  return tl::unexpected(Error{.exitCode = code, .what = std::move(what), .remedy = std::move(remedy)});
}

using Opened = tl::expected<std::unique_ptr<capture::Driver>, Error>;

Opened open(Connection& connection, const capture::CameraOptions& options, const capture::Opening& opening) {
  constexpr std::int64_t kSearch_ns = kSecond, kProof_ns = kSecond, kTakesControl_ns = 8 * kSecond;
  constexpr int kSettings = 8;
  const Camera& camera = connection.camera;
  if (!ask(camera, kSearch_ns)) return refused(EX_UNAVAILABLE, "camera Simulated-1 does not answer", kAddress);
  if (camera.isHeld()) {
    const std::string held = fmt::format("camera Simulated-1 at {} is held by another client", kAddress);
    opening.say(capture::LogLevel::kWarning, held);
    spent_ns() += std::min(camera.heldFor_ns(), kTakesControl_ns);
    if (camera.heldFor_ns() > kTakesControl_ns) return refused(EX_TEMPFAIL, held, "close that client");
  }
  opening.found();
  spent_ns() += camera.hangsFor_ns();
  for (int i = 0; i < kSettings; ++i) ask(camera, kRepeats_ns);
  const std::int64_t streamsFrom_ns = now() + spent_ns();
  if (!options.features.empty()) return refused(EX_CONFIG, "the camera has no feature NoSuchFeature");
  spent_ns() += std::min(camera.silentFor_ns(), kProof_ns);  // a whole frame is awaited
  connection.options = options;
  return std::make_unique<SimulatedDriver>(connection, streamsFrom_ns);
}

}  // namespace

capture::OpenDriver fromSimulation(Connection& connection, const capture::CameraOptions& options) {
  return [&connection, options](const capture::Opening& opening) {
    Opened opened = open(connection, options, opening);
    connection.refused = opened ? "" : opened.error().what;
    return opened;
  };
}

}  // namespace tractiond::simulation
