// Makes forces of frames: tracker, solver, procedures of the zero, checks of the gel file, and the recorder.
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

class Measurement : public Processing {
 public:
  /// Makes the solver, which takes seconds once per gel, and completes the description.
  static tl::expected<std::unique_ptr<Processing>, Error> make(sensor::Sensor sensor, const Surroundings& around);

  /// Waits for the work that is under way: a zero that is being written, a step of a calibration.
  ~Measurement() override;

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
  bool isFilm_;  // of a file's pictures each is measured
  sensor::Sensor sensor_;
  std::string cameraId_;                        // as restored_
  std::optional<RestPose> restored_, earlier_;  // written before the control thread meets the camera, read after
  bool isRestoredWritten_ = true;               // so that a loss of power does not take it back; as restored_
  std::unique_ptr<track::Tracker> tracker_;
  std::shared_ptr<solve::FieldSolver> solver_;  // the solving thread's own once it runs
  // What is slow. A disk that hangs must not hold up what is computed, nor a computation of a minute the disk.
  BackgroundThread disk_{"tr-disk"}, compute_{"tr-compute"};
  std::unique_ptr<RestSolver> restSolver_;  // none: what solves takes nothing from a zero but displacements
  Mailbox<MarkerField> newestMarkers_;      // from the tracking thread to control
  Mailbox<Watched> watched_;                // from control to the publishing thread
  Mailbox<traction::v1::MarkerStatus> newestMarkerStatus_;  // the same
  Counter tracked_;                                         // frames that the tracker has looked at
  std::unique_ptr<Recorder> recorder_;

  // The control thread's own.
  std::unique_ptr<Procedures> procedures_;
  std::unique_ptr<GelWatch> gelWatch_;
  bool hasMet_ = false;  // a camera
  PixelFormat format_ = PixelFormat::kRgb8;

  // The publishing thread's own.
  Watched lastWatched_;
  InvalidFields invalidFields_;
};

}  // namespace tractiond
