// Everything one instance runs, made in order from a configuration.
#pragma once

#include "daemon/capture/camera.h"
#include "daemon/config.h"
#include "daemon/gel_watch.h"
#include "daemon/instance.h"
#include "daemon/invalid_fields.h"
#include "daemon/pipeline.h"
#include "daemon/previewer.h"
#include "daemon/procedures.h"
#include "daemon/publish/control.h"
#include "daemon/publish/frozen_peers.h"
#include "daemon/publish/greeting.h"
#include "daemon/publish/inflow_limit.h"
#include "daemon/publish/publisher.h"
#include "daemon/recorder.h"
#include "daemon/service.h"
#include "daemon/solve/solver.h"
#include "daemon/track/tracker.h"

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace tractiond {

/// The gel file's sensor, the paper's where the name is empty. Fails also for one that cannot be tracked.
tl::expected<sensor::Sensor, Error> loadSensor(const std::string& gelFile);

/// What a description says of sensor and solver.
void describeSensor(publish::Description& description, const sensor::Sensor& sensor, const solve::SolveOptions& solve);

/// The gel file and the influence file that it names, as they are on the disk. Empty: the built-in gel, or it has gone.
void readGelFiles(const sensor::Sensor& sensor, const std::string& gelFile, publish::Beginning& beginning);

/// Thread-bound, but for what the pipeline's threads do within.
class Instrument {
 public:
  /// First what fails fast: the gel, the directories, the sockets; then the inverse (seconds, once per gel) and the
  /// camera. Nothing is left behind on an error.
  /// \param logLinesLost asked from the publisher's thread once a second
  static tl::expected<std::unique_ptr<Instrument>, Error> make(const Config& config, const Places& places,
                                                               std::function<std::uint64_t()> logLinesLost = {});
  ~Instrument();

  void start();
  ServiceHooks hooks();

  /// Takes what is new in a configuration, or nothing of it where something in it is wrong or needs a restart: that is
  /// the error. \return what is new, "camera.gain = 2 (was 1)". A camera that refuses it says so, and is opened as
  /// before.
  tl::expected<std::vector<std::string>, Error> reload(const Config& completed);

  /// Stops the pipeline and closes the account. Fails with what made the pipeline end by itself, or with EX_SOFTWARE
  /// when the ledger does not balance.
  tl::expected<void, Error> stop();

 private:
  Instrument(Config config, OwnDirectory state, OwnDirectory runtime);
  tl::expected<void, Error> build();
  tl::expected<void, Error> welcome(const capture::CameraInfo& info);
  void beginRecording(const capture::CameraInfo& info);
  void control(std::chrono::milliseconds timeout);
  capture::OpenDriver driver() const;
  void awaitFirstVerdict();
  tl::expected<void, Error> openCamera();
  void meetCamera();
  std::optional<RestPose> earlierZero(const capture::CameraInfo& info) const;
  void describeCamera(const capture::CameraInfo& info);
  void makeProcedures();
  publish::Vitals vitals();
  std::string statusLine() const;

  // In the order of their making, which is the reverse of their unmaking.
  Config config_;
  std::function<std::uint64_t()> logLinesLost_;
  std::shared_ptr<Realtime> realtime_;  // and Aravis's thread's, of a camera that is closed in its own time
  OwnDirectory state_, runtime_;
  std::filesystem::path stateDirectory_;
  sensor::Sensor sensor_;
  Ledger ledger_;
  Turns turns_;
  publish::Description description_;            // after the start the control thread's
  std::string cameraId_;                        // as restored_
  std::optional<RestPose> restored_, earlier_;  // written before the camera's first info() is there, read after
  solve::Inverse inverse_;
  std::unique_ptr<track::Tracker> tracker_;
  std::unique_ptr<solve::Solver> solver_;
  Mailbox<MarkerField> newestMarkers_;                 // from the tracking thread to control
  Mailbox<Watched> watched_;                           // from control to the publishing thread
  Mailbox<publish::MarkerStatus> newestMarkerStatus_;  // the same
  Counter tracked_;                                    // frames that the tracker has looked at
  std::unique_ptr<publish::Publisher> publisher_;
  std::optional<Previewer> previewer_;
  std::unique_ptr<Recorder> recorder_;
  std::unique_ptr<publish::ControlServer> controlServer_;
  std::unique_ptr<capture::Camera> camera_;
  std::unique_ptr<Pipeline> pipeline_;
  std::vector<publish::Greeting> greetings_;  // run()'s

  // The control thread's own.
  std::unique_ptr<Procedures> procedures_;
  std::unique_ptr<GelWatch> gelWatch_;
  std::optional<publish::FrozenPeers> frozenPeers_;
  publish::inflow::Report inflow_;
  unsigned describedSession_ = 0;  // of the camera
  bool cameraAsked_ = false;

  // The publishing thread's own.
  Watched lastWatched_;
  CameraVitals cameraVitals_;
  publish::MarkerStatus markerStatus_;
  InvalidFields invalidFields_{config_.track, config_.solve};
  publish::SchedulingStatus scheduling_;
};

}  // namespace tractiond
