// Computes forces from frames: owns tracker, solver, procedures of the zero, checks of the gel file, and the recorder.
#pragma once

#include "base/background_thread.h"
#include "daemon/gel_watch.h"
#include "daemon/invalid_fields.h"
#include "daemon/procedures.h"
#include "daemon/processing.h"
#include "daemon/recorder.h"
#include "daemon/rest_solver.h"
#include "daemon/solve/field_solver.h"
#include "daemon/track/tracker.h"
#include "sensor/sensor.h"

#include <memory>
#include <optional>
#include <string>

namespace tractiond {

/// The processing of an instrument with a gel file.
class Measurement : public Processing {
 public:
  /// Makes the solver, which takes seconds for a new gel and less afterwards, and completes the description. Fails if
  /// the solver cannot be made.
  static tl::expected<std::unique_ptr<Processing>, Error> make(sensor::Sensor sensor, const Surroundings& around);

  /// Waits for the work that is under way: a zero that is being written, a step of a calibration.
  ~Measurement() override;

  // Implement Processing, which describes each of these functions and names its thread.

  PipelineOptions pipelineOptions() const override;
  tl::expected<void, Error> welcome(const capture::CameraInfo& info) override;
  bool track(const Frame& frame, MarkerField& markers) override;
  void solve(const MarkerField& markers, TractionField& field) override;
  void takeField(const TractionField& field) override;
  void measure(traction::v1::Status& status) override;
  void meet(const capture::CameraInfo& info) override;
  void beginZero(const ZeroRequest& request) override { procedures_->beginZero(request); }
  void beginStep(const CalibrationStep& step) override { procedures_->beginStep(step); }
  void askSnapshot() override { gelWatch_->askSnapshot(); }
  void turn() override;
  bool hurried() const override { return procedures_->hurried() || gelWatch_->hurried(); }
  bool isRecording() const override { return recorder_ != nullptr; }
  void recordTurn(std::chrono::milliseconds timeout) override { recorder_->turn(timeout); }
  tl::expected<void, Error> finish() override;

 private:
  Measurement(sensor::Sensor sensor, const Surroundings& around);
  tl::expected<void, Error> build();
  void makeProcedures();
  void beginRecording(const capture::CameraInfo& info);
  void awaitFirstZero();
  std::optional<RestPose> earlierZero(const capture::CameraInfo& info) const;

  Surroundings around_;
  bool isFilm_;  // the pictures come from a file, and every one is measured
  sensor::Sensor sensor_;
  std::string cameraId_;                        // as restored_
  std::optional<RestPose> restored_, earlier_;  // written before the control thread meets the camera, read after
  bool isRestoredWritten_ = true;               // false: a loss of power may undo restored_; accessed as restored_
  std::unique_ptr<track::Tracker> tracker_;
  std::shared_ptr<solve::FieldSolver> solver_;  // used by the solving thread alone once it runs
  // Threads for slow work. They are separate, as a disk may hang, and a computation may take a minute.
  BackgroundThread disk_{"tr-disk"}, compute_{"tr-compute"};
  std::unique_ptr<RestSolver> restSolver_;  // none: the solver does not depend on the places of markers in the zero
  Mailbox<MarkerField> newestMarkers_;      // from the tracking thread to control
  Mailbox<Watched> watched_;                // from control to the publishing thread
  Mailbox<traction::v1::MarkerStatus> newestMarkerStatus_;  // from control to the publishing thread
  Counter tracked_;                                         // frames that the tracker has processed
  std::unique_ptr<Recorder> recorder_;

  // Used by the control thread alone.
  std::unique_ptr<Procedures> procedures_;
  std::unique_ptr<GelWatch> gelWatch_;
  bool hasMet_ = false;  // meet() was called
  PixelFormat format_ = PixelFormat::kRgb8;

  // Used by the publishing thread alone.
  Watched lastWatched_;
  InvalidFields invalidFields_;
};

}  // namespace tractiond
