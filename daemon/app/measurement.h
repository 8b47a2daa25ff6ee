// Computes forces from frames: owns tracker, solver, procedures of the zero, checks of the gel file, and the recorder.
#pragma once

#include "base/background_thread.h"
#include "daemon/app/processing.h"
#include "daemon/app/prompt_solver.h"
#include "daemon/app/rest_solver.h"
#include "daemon/calibrate/zero_tracking.h"
#include "daemon/control/gel_watch.h"
#include "daemon/control/procedures.h"
#include "daemon/record/recorder.h"
#include "daemon/solve/field_solver.h"
#include "daemon/track/creep_memory.h"
#include "daemon/track/tracker.h"
#include "sensor/measured_with.h"
#include "sensor/sensor.h"

#include <memory>
#include <optional>
#include <string>

namespace tractiond {

/// The processing of an instrument with a gel file.
class Measurement : public Processing, private control::ProcedureHost {
 public:
  /// Makes the solver, which takes seconds for a new gel and less afterwards, and completes and publishes the
  /// description. EX_CONFIG: the influence matrix of the gel file is not finite or all 0. EX_SOFTWARE: its factors
  /// are not found. EX_CANTCREAT: the file of a recording cannot be created. What `around` refers to must outlive the
  /// result.
  static tl::expected<std::unique_ptr<Processing>, Error> make(sensor::Sensor sensor, const Surroundings& around);

  /// Waits for the work that is under way: a zero that is being written, a step of a calibration, and a solver that is
  /// being made, which is given up at its next step.
  ~Measurement() override;

  // These implement Processing, which names the thread of each.

  /// Returns the numbers of markers and nodes; frames before a first zero is in force are counted as
  /// Ledger::noRestPose.
  PipelineOptions pipelineOptions() const override;
  /// Checks that the markers can be tracked in the camera's picture size and format, that the gel file was not
  /// calibrated with another camera, and in later sessions that it is the camera of the first one. In the first session
  /// also restores the zero, which must belong to this camera, and begins the recording. EX_CONFIG: the camera, its
  /// picture or its format does not fit the gel file. EX_UNAVAILABLE: it is not the camera of the first session.
  /// EX_NOINPUT, EX_DATAERR: the zero cannot be read, is damaged, or belongs to another sensor, picture or camera.
  tl::expected<void, Error> acceptCamera(const capture::CameraInfo& info) override;
  /// Finds the markers, and copies the frame for a snapshot and the recording. Returns false while there is no rest
  /// pose, or the first one has not been compared with the gel file. Pictures from a file wait for that comparison, and
  /// for the solver for the zero's places, unless the pipeline is stopping.
  bool track(const Frame& frame, MarkerField& markers) override;
  /// Computes the forces, with the newest solver that is ready: of pictures from a file by a model of each, else in
  /// time.
  void solve(const MarkerField& markers, TractionField& field) override;
  /// Counts a field that is not valid (Ledger::invalid) and notes it for measure(); passes every field to the
  /// recorder, if there is one.
  void takeField(const TractionField& field) override;
  /// Sets the fields of the status that concern markers, zero and drift, and why fields are not valid.
  void measure(traction::v1::Status& status) override;
  /// Notes the pixel format; in the first session also begins the procedures of the zero.
  void beginSession(const capture::CameraInfo& info) override;
  // Begin a request, which is answered through Surroundings::replies.
  void beginZero(const ZeroRequest& request) override { procedures_->zero().begin(request); }
  void beginStep(const CalibrationStep& step) override { procedures_->beginStep(step); }
  void askSnapshot() override { gelWatch_->askSnapshot(); }
  /// Does what is due in the procedures, in the checks of the gel file, and for the solver of a new zero.
  void turn() override;
  bool hurried() const override { return procedures_->hurried() || gelWatch_->hurried(); }
  void model(std::chrono::milliseconds timeout) override { promptSolver_->turn(timeout); }
  void record(std::chrono::milliseconds timeout) override { recorder_->turn(timeout); }
  /// Explains missing markers a last time, and closes the recording, if there is one. Logs its summary, or returns its
  /// error.
  tl::expected<void, Error> finish() override;

 private:
  Measurement(sensor::Sensor sensor, const Surroundings& around);
  tl::expected<void, Error> build();
  void beginRecording(const capture::CameraInfo& info);
  void awaitFirstZero();

  // These implement control::ProcedureHost.
  void describe(const RestPose& zero) override;
  std::future<tl::expected<void, Error>> keep(const RestPose& zero, const RestPose* before) override;
  std::future<std::optional<calibrate::Result>> start(control::StepWork work) override;

  std::string whyInvalid();

  Surroundings around_;
  bool isFilm_;  // the pictures come from a file, and every one is measured
  sensor::Sensor sensor_;
  sensor::MeasuredWith measuredWith_;           // as restored_
  std::optional<RestPose> restored_, earlier_;  // written before the control thread knows the camera, read after
  std::unique_ptr<track::Tracker> tracker_;
  track::CreepMemory creep_;                  // used by the tracking thread alone
  calibrate::ZeroTracking zeroTracking_;      // as creep_
  PlacedSolver solver_;                       // used by the solving thread alone once it runs
  std::optional<PromptSolver> promptSolver_;  // none: the pictures come from a file
  Id places_{};  // the zero of the solver for the next frame; used by the tracking thread alone
  // Threads for slow work. They are separate, as a disk may hang, and a computation may take a minute.
  BackgroundThread disk_{"tr-disk"}, compute_{"tr-compute"};
  std::unique_ptr<RestSolver> restSolver_;  // none: the solver does not depend on the places of markers in the zero
  Mailbox<MarkerField> newestMarkers_;      // from the tracking thread to control
  Mailbox<control::Watched> watched_;       // from control to the publishing thread
  Mailbox<traction::v1::MarkerStatus> newestMarkerStatus_;  // from control to the publishing thread
  Counter tracked_;                                         // frames that the tracker has processed
  std::unique_ptr<Recorder> recorder_;
  std::string recordedConfig_;  // as of the start: a reload may change the configuration, but nothing that is solved

  // Used by the control thread alone.
  std::unique_ptr<control::Procedures> procedures_;
  std::unique_ptr<control::GelWatch> gelWatch_;
  bool hasSession_ = false;  // beginSession() was called
  PixelFormat format_ = PixelFormat::kRgb8;

  // Used by the publishing thread alone.
  control::Watched lastWatched_;
  struct Invalid {
    std::uint32_t flags;
    int found, markers;
  };
  std::optional<Invalid> invalid_;  // newest field that was not valid since the last status
};

}  // namespace tractiond
