// What an instrument does with its frames. There are two kinds: Measurement, and NoGel, which shows pictures and
// measures nothing.
#pragma once

#include "daemon/capture/camera_info.h"
#include "daemon/config.h"
#include "daemon/pipeline.h"
#include "daemon/publish/control.h"
#include "daemon/publish/publisher.h"
#include "daemon/records/calibration.h"
#include "daemon/records/zero_request.h"

#include <tl/expected.hpp>

#include <chrono>
#include <filesystem>
#include <functional>

namespace tractiond {

/// The instrument around a processing, which it outlives.
struct Surroundings {
  const Config& config;  ///< completed
  const std::filesystem::path& stateDirectory;
  Ledger& ledger;
  Turns& turns;
  publish::Description& description;  ///< the control thread's once the pipeline runs
  publish::Publisher& publisher;
  publish::ControlServer& control;
  std::function<bool()> stopping;  ///< tells whether the pipeline is being stopped. Thread-safe
};

/// Each group of functions is called by the thread that its comment names.
class Processing {
 public:
  virtual ~Processing() = default;

  /// Tells how large the records are, and how frames are counted that track() does not use. Before the pipeline is
  /// made.
  virtual PipelineOptions pipelineOptions() const = 0;

  // camera-keeper

  /// Judges a camera, for each session before its first frame. An error of the first session ends the instrument.
  virtual tl::expected<void, Error> welcome(const capture::CameraInfo& info) = 0;

  // tr-track, tr-solve, tr-publish, as Stages says: nothing is allocated or locked

  virtual bool track(const Frame& frame, MarkerField& markers) = 0;
  virtual void solve(const MarkerField& markers, TractionField& field) = 0;
  /// Called for each field that was published.
  virtual void takeField(const TractionField& field) = 0;
  /// Sets what it knows in a status, which keeps what was set before.
  virtual void measure(traction::v1::Status& status) = 0;

  // tr-control

  /// Called once for each session of the camera, after welcome().
  virtual void meet(const capture::CameraInfo& info) = 0;
  // Each of these requests is answered through the control server, at once or in a later turn().
  virtual void beginZero(const ZeroRequest& request) = 0;
  virtual void beginStep(const CalibrationStep& step) = 0;
  virtual void askSnapshot() = 0;
  /// Does what is due.
  virtual void turn() = 0;
  /// Tells whether turn() should be called for every frame.
  virtual bool hurried() const = 0;

  // tr-record

  /// Tells whether recordTurn() is to be called; before the pipeline is made.
  virtual bool isRecording() const = 0;
  /// As Stages::record.
  virtual void recordTurn(std::chrono::milliseconds timeout) = 0;

  // main

  /// Closes what was recorded, when the pipeline has stopped.
  virtual tl::expected<void, Error> finish() = 0;
};

}  // namespace tractiond
