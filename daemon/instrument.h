// Everything that one instance runs, made from a configuration.
#pragma once

#include "base/network/connection_limit.h"
#include "base/network/inflow_limit.h"
#include "base/service/service.h"
#include "daemon/capture/camera.h"
#include "daemon/config.h"
#include "daemon/instance.h"
#include "daemon/pipeline.h"
#include "daemon/previewer.h"
#include "daemon/processing.h"
#include "daemon/publish/control.h"
#include "daemon/publish/frozen_peers.h"
#include "daemon/publish/greeting.h"
#include "daemon/publish/publisher.h"
#include "sensor/sensor.h"

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace tractiond {

/// Thread-bound; threads of the pipeline call its parts.
class Instrument {
 public:
  /// Makes first what fails fast: the gel, the directories, the sockets; then the inverse (seconds, once per gel) and
  /// the camera. After an error nothing remains. \param logLinesLost returns a number for the status; called on the
  /// publisher's thread once a second
  static tl::expected<std::unique_ptr<Instrument>, Error> make(const Config& config, const Places& places,
                                                               std::function<std::uint64_t()> logLinesLost = {});
  ~Instrument();

  void start();
  ServiceHooks hooks();

  /// Applies the changes of a configuration, and returns them: "camera.gain = 2 (was 1)". Applies none, and fails, if
  /// one of them is wrong or needs a restart. If the camera refuses them, the log says so, and it is opened as before.
  tl::expected<std::vector<std::string>, Error> reload(const Config& completed);

  /// Stops the pipeline and checks the ledger. Fails with the error that ended the pipeline, or with EX_SOFTWARE if the
  /// ledger does not balance.
  tl::expected<void, Error> stop();

 private:
  Instrument(Config config, OwnDirectory state, OwnDirectory runtime);
  tl::expected<void, Error> build(std::optional<sensor::Sensor> gel);
  tl::expected<void, Error> openSockets();
  tl::expected<void, Error> makeProcessing(std::optional<sensor::Sensor> gel);
  void control(std::chrono::milliseconds timeout);
  capture::OpenDriver driver() const;
  tl::expected<void, Error> openCamera();
  void meetCamera();
  void watchLastWill();
  void describeCamera(const capture::CameraInfo& info);
  void measure(traction::v1::Status& status);
  std::string statusLine() const;

  // In the order of construction.
  Config config_;
  std::function<std::uint64_t()> logLinesLost_;
  std::shared_ptr<Realtime> realtime_;  // shared with Aravis's thread, as a camera may be closed later
  OwnDirectory state_, runtime_;
  std::filesystem::path stateDirectory_;
  std::string instance_;
  Ledger ledger_;
  Turns turns_;
  publish::Description description_;  // after the start for the control thread alone
  std::unique_ptr<publish::Publisher> publisher_;
  std::optional<Previewer> previewer_;
  std::unique_ptr<publish::ControlServer> controlServer_;
  std::unique_ptr<Processing> processing_;
  std::unique_ptr<capture::Camera> camera_;
  std::unique_ptr<Pipeline> pipeline_;
  std::vector<publish::Greeting> greetings_;  // for run()

  // For the control thread alone.
  std::optional<publish::FrozenPeers> frozenPeers_;
  network::inflow::Report inflow_;
  network::connections::Report connections_;
  std::string lockedWhy_;          // reason of the last warning
  unsigned describedSession_ = 0;  // of the camera
  bool cameraAsked_ = false;

  // For the publishing thread alone.
  CameraVitals cameraVitals_;
};

}  // namespace tractiond
