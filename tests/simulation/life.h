// One life of the daemon, from its start to its end: the real camera with its keeper and frame gate, pipeline, solver,
// procedures, reload and service loop.
#pragma once

#include "daemon/app/pipeline.h"
#include "daemon/control/procedures.h"
#include "tests/simulation/askers.h"
#include "tests/simulation/capture_side.h"
#include "tests/simulation/fields.h"
#include "tests/simulation/operator.h"
#include "tests/simulation/solve_side.h"
#include "tests/simulation/supervisor.h"
#include "tests/simulation/tracker.h"

#include <vector>

namespace tractiond::simulation {

/// Work of a calibration's steps.
using StepWork = Later<std::optional<calibrate::Result>>;

/// What a life happens in. Outlives it.
struct Around {
  const Gel& gel;
  Camera& camera;
  Zeros& zeros;
  Askers& askers;
  Operator& person;
  Fields& fields;
  Journal& journal;
  Chance& chance;
  const Starvation& starvation;
  Modelling& modelling;
  const Ongoing& ongoing;
  StepWork& stepWork;
};

class Life : public capture::FrameSource,
             Stages,
             track::ZeroTracker,
             control::GelComparison,
             control::ProcedureHost,
             control::Replies {
 public:
  /// Restores what is on the disk.
  explicit Life(const Around& around);

  /// Takes one turn of a stage, or goes on with that of the solving stage if it waits.
  /// \return whether there was something to do, and it is done
  bool turn(Stage stage);
  /// Returns until when a stage waits in the middle of its turn; 0: it does not.
  std::int64_t waitsUntil_ns(Stage stage) const {
    return stage == Stage::kSolve && solveThread_.waits() ? solveThread_.wakes_ns() : 0;
  }
  SolveSide& solving() { return solving_; }
  /// Returns whether the source of pictures has ended by itself.
  bool hasEnded() const { return pipeline_.ended(); }
  /// Returns when the capture stage wakes; kNever: it has ended.
  std::int64_t wakes_ns() const { return hasEnded() ? kNever : camera_.wakes_ns(); }
  /// Works off what is in flight, as the daemon does when it stops.
  void stop();
  /// received = published + named losses, but for what is in flight.
  void checkBalance(std::uint64_t inFlight) const;
  /// Laws: links evict nothing unless a stage had no processor for longer than they bridge, or frames came in a burst;
  /// that before the solver bridges no stall.
  /// \param solvesBurst frames of a burst may still wait for the solver
  void checkEvictions(bool inBurst, bool solvesBurst);

  /// Asks for what happens to be asked for. The next turn of the control thread begins it; as by the control server,
  /// one zero, and one feature of the camera, is asked for at a time.
  void ask(const Happening& one) { asked_.push_back(one); }

  const control::Procedures& procedures() const { return procedures_; }
  Supervisor& supervisor() { return supervisor_; }
  const Ledger& ledger() const { return ledger_; }

  CaptureSide& camera() { return camera_; }

  capture::Next next(Frame& frame, std::chrono::milliseconds timeout) override;
  void recycle(Frame& frame) override { camera_.recycle(frame); }

  /// Law: a reload takes all of a configuration or nothing.
  void checkConfiguration();

 private:
  // The stages.
  bool track(const Frame& frame, MarkerField& markers) override;
  void solve(const MarkerField& markers, TractionField& field) override;
  void publish(const TractionField& field) override;
  void serveSubscribers(int /*fd*/, std::chrono::milliseconds /*timeout*/) override {}
  void control(std::chrono::milliseconds timeout) override;

  void takeOver(const tl::expected<Reread, Error>& read);
  void meetCamera();
  void begin(const Happening& one);
  double zeroWithin_s();
  void beginStep(const CalibrationStep& step);
  /// Returns the time within which a calibration step that is asked for now is answered.
  std::int64_t stepWithin_ns(const CalibrationStep& step) const;

  ServiceHooks hooks();

  // The parts around the procedures.
  void requestZero() override { tracker_.request(); }
  bool cancelZero() override { return tracker_.cancel(); }
  track::ZeroState zeroState() const override { return tracker_.state(); }
  bool takeRestPose(RestPose& pose) override;
  bool putInForce(const RestPose& pose, bool fits) override;
  GelReport compare(const RestPose& zero) override;
  void report(const RestPose& zero, const GelReport& report) override;
  void describe(const RestPose& zero) override { around_.zeros.describe(zero); }
  std::future<tl::expected<void, Error>> keep(const RestPose& zero, const RestPose* before) override {
    return around_.zeros.keep(zero, before);
  }
  std::future<std::optional<calibrate::Result>> start(control::StepWork work) override {
    return around_.stepWork.begin(work);
  }
  void answerZero(const tl::expected<RestPose, std::string>& result, const std::string& /*remark*/) override {
    around_.askers.noteZeroAnswer(result);
  }
  void answerCalibration(const calibrate::Result& result) override { around_.askers.noteStepAnswer(result); }
  void answerSnapshot(const tl::expected<const Snapshot*, std::string>& /*result*/,
                      const std::vector<sensor::MarkerLayer>& /*layers*/) override {}

  Around around_;
  Reread start_;  ///< its configuration is that in force
  Ledger ledger_;
  Turns turns_;
  SolveSide solving_;
  Tracker tracker_;
  static constexpr std::size_t kNumbers = 4096;  // more than are in flight
  std::vector<Truth> truths_;                    ///< by numbers of frames
  CaptureSide camera_;
  std::vector<Happening> asked_;  ///< what the control thread has not begun yet
  Counter frames_;
  Mailbox<MarkerField> newest_;
  Mailbox<control::Watched> watched_;
  control::Watched lastWatched_;
  Pipeline pipeline_;
  std::array<bool, Supervisor::kStages> hasStageEnded_{};
  const ServiceHooks hooks_;
  Supervisor supervisor_;
  control::Procedures procedures_;
  Zeros::Left restored_;
  std::uint64_t evicted_ = 0, passedOver_ = 0;  ///< by other links than the solver's, and by that, at the last look
  std::uint64_t tracked_ = 0;                   ///< number of the frame that was tracked last
  bool hasMet_ = false;                         ///< the procedures know the camera
  bool worked_ = false;                         ///< the stage that takes its turn has something to do
  Fiber solveThread_;                           ///< last: its end takes a turn
};

}  // namespace tractiond::simulation
