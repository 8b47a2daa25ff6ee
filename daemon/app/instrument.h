// Makes and runs all parts of one instance from a configuration.
#pragma once

#include "base/service/log.h"
#include "base/service/service.h"
#include "daemon/app/adoption.h"
#include "daemon/app/config.h"
#include "daemon/app/instance.h"
#include "daemon/app/pipeline.h"
#include "daemon/app/previewer.h"
#include "daemon/app/processing.h"
#include "daemon/app/reload.h"
#include "daemon/capture/camera.h"
#include "daemon/control/control_server.h"
#include "daemon/publish/publisher.h"
#include "sensor/sensor.h"

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace tractiond {

/// Thread-bound, except for what the pipeline's threads do within.
class Instrument final : Stages {
 public:
  /// Makes the parts: first those that fail fast (the gel, the directories, the sockets), then the solver (seconds,
  /// once per gel) and the camera. Blocks meanwhile, for the camera until the first try to open it has ended. On an
  /// error nothing is left behind but the file of the factors, and parents of the directories that were created.
  /// EX_USAGE: a recording without a gel. EX_CONFIG: the gel file, an endpoint or a setting of the camera is wrong.
  /// EX_NOINPUT, EX_DATAERR: a file cannot be read, or is damaged or of another sensor. EX_TEMPFAIL: a directory or the
  /// camera is in use. EX_UNAVAILABLE: there is no such camera, or an address is in use. EX_CANTCREAT, EX_NOPERM,
  /// EX_OSERR: a file, directory or socket cannot be made. EX_SOFTWARE: the solver cannot be made.
  /// \param config not completed() yet; copied
  /// \param places located()
  /// \param log states the number of lost log lines; may be empty
  static tl::expected<std::unique_ptr<Instrument>, Error> make(const Config& config, const Places& places,
                                                               std::shared_ptr<const Log> log = {});
  /// Stops the pipeline if stop() was not called (a recording then has no end), and waits for a zero that is being
  /// written, for a solver that is being made and for a calibration step.
  ~Instrument();

  /// Starts the pipeline's threads, and returns when they run. Applies and logs the real-time settings. Must be called
  /// once. Fails with EX_OSERR if a thread cannot be started.
  tl::expected<void, Error> start();
  /// Returns the hooks for run(), without ServiceHooks::reload. Their functions use this object, which must outlive
  /// them.
  ServiceHooks hooks();
  /// Applies what a reload has read, and logs the result. For the thread of run().
  void takeOver(const tl::expected<Reread, Error>& read);

  /// Stops the pipeline, closes the recording and checks the ledger; waits until the frames in flight are published.
  /// Must be called once, after start(). Fails with the error for which the source ended by itself, else with
  /// EX_SOFTWARE if the ledger does not balance, else with the error of the recording. Succeeds if the source ended
  /// because the pictures of a file are over.
  tl::expected<void, Error> stop();

 private:
  Instrument(Config config, OwnDirectory state, OwnDirectory runtime);
  tl::expected<void, Error> build(std::optional<sensor::Sensor> gel);
  tl::expected<void, Error> openSockets();
  tl::expected<void, Error> makeProcessing(std::optional<sensor::Sensor> gel);

  // These implement Stages.
  bool track(const Frame& frame, MarkerField& markers) override;
  void solve(const MarkerField& markers, TractionField& field) override { processing_->solve(markers, field); }
  void publish(const TractionField& field) override;
  void serveSubscribers(int fd, std::chrono::milliseconds timeout) override { publisher_->serve(fd, timeout); }
  void control(std::chrono::milliseconds timeout) override;
  void preview(std::chrono::milliseconds timeout) override { previewer_->turn(timeout); }
  void model(std::chrono::milliseconds timeout) override { processing_->model(timeout); }
  void record(std::chrono::milliseconds timeout) override { processing_->record(timeout); }
  void enter() override { realtime_->enter(); }

  capture::OpenDriver driver() const;
  tl::expected<void, Error> openCamera();
  void adopt(const std::string& gelFile);
  void meetCamera();
  void giveMemoryBack(std::int64_t now_ns);
  void measure(traction::v1::Status& status);
  std::string statusLine() const;

  // In the order of construction.
  Config config_;
  std::shared_ptr<const Log> log_;
  std::shared_ptr<Realtime> realtime_;  // shared with Aravis's thread, as a camera may be closed later
  OwnDirectory state_, runtime_;
  std::filesystem::path stateDirectory_;
  Ledger ledger_;
  Turns turns_;
  publish::Description description_;  // after the start for the control thread alone
  std::unique_ptr<publish::Publisher> publisher_;
  std::optional<Previewer> previewer_;
  std::unique_ptr<control::ControlServer> controlServer_;
  std::unique_ptr<Processing> processing_;
  std::unique_ptr<capture::Camera> camera_;
  std::unique_ptr<Pipeline> pipeline_;
  Adoption adoption_;  // for the control thread, and run()

  // For the control thread alone.
  std::int64_t trimmed_ns_ = 0;
  unsigned describedSession_ = 0;  // of the camera
  bool cameraAsked_ = false;

  // For the publishing thread alone.
  CameraVitals cameraVitals_;
};

}  // namespace tractiond
