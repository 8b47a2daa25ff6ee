// Interface of what an instrument does with its frames. There are two kinds: Measurement, and NoGel, which shows
// pictures and measures nothing.
#pragma once

#include "daemon/app/config.h"
#include "daemon/app/pipeline.h"
#include "daemon/capture/camera_info.h"
#include "daemon/control/requests.h"
#include "daemon/publish/publisher.h"

#include <tl/expected.hpp>

#include <chrono>
#include <filesystem>
#include <memory>

namespace tractiond {

/// The parts of the instrument that a processing uses; they outlive it.
struct Surroundings {
  const Config& config;  ///< completed
  const std::filesystem::path& stateDirectory;
  Ledger& ledger;
  Turns& turns;
  publish::Description& description;  ///< for the control thread alone once the pipeline runs
  publish::Publisher& publisher;
  control::Replies& replies;
  const std::unique_ptr<Pipeline>& pipeline;  ///< made before its first frame
};

/// The comment above each group of functions names the thread that calls it.
class Processing : public control::Requests {
 public:
  virtual ~Processing() = default;

  /// Returns the sizes of the records, the counter of frames for which track() returns false, and whether there are
  /// threads for model() and record(). Called before the pipeline is made.
  virtual PipelineOptions pipelineOptions() const = 0;

  // camera-keeper

  /// Checks the camera of a session, which lasts from its opening to its loss or the next opening; called for each
  /// session before its first frame. An error in the first session ends the instrument, which exits with its code;
  /// after one in a later session the camera is opened again. May wait for a disk.
  virtual tl::expected<void, Error> acceptCamera(const capture::CameraInfo& info) = 0;

  // tr-track, tr-solve, tr-publish, each on its own thread; see Stages. They lock nothing, and allocate nothing after
  // the first frames, except measure().

  /// Implements Stages::track: fills `markers`, or returns false if there is nothing to publish of this frame.
  virtual bool track(const Frame& frame, MarkerField& markers) = 0;
  /// Implements Stages::solve: fills `field`.
  virtual void solve(const MarkerField& markers, TractionField& field) = 0;
  /// Called by tr-publish for each field that was published.
  virtual void takeField(const TractionField& field) = 0;
  /// Called by tr-publish before each status. Sets the fields that belong to the processing; leaves the others as they
  /// are. May allocate.
  virtual void measure(traction::v1::Status& status) = 0;

  // tr-control

  /// Called once for each session of the camera, after acceptCamera().
  virtual void beginSession(const capture::CameraInfo& info) = 0;
  // Requests, whose functions implementations override: a zero that is taken or comes into force ends a step that looks
  // at frames, with an error; a step other than kStiffness and kFinish ends an open request for a zero, with an error
  // unless its zero has been taken.

  /// Does what is due. Called in each turn of the control loop.
  virtual void turn() = 0;
  /// Returns whether turn() should be called for every frame: frames are averaged, for a zero or
  /// a calibration step.
  virtual bool hurried() const = 0;

  // tr-model, tr-record, if pipelineOptions() says that there are such threads.

  /// Implements Stages::model.
  virtual void model(std::chrono::milliseconds /*timeout*/) {}
  /// Implements Stages::record.
  virtual void record(std::chrono::milliseconds /*timeout*/) {}

  // main

  /// Closes the recording, if there is one, and returns its error, if there was one. Called once, when the pipeline has
  /// stopped.
  virtual tl::expected<void, Error> finish() = 0;
};

}  // namespace tractiond
