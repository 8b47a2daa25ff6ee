// The stages, the links between them, the threads they run on, and the order in which these start and stop.
//
//   capture ──frames──> track ──markers──> solve ──fields──> publish          control
//
// A stage is a function, a link a bounded queue, a thread a line in pipeline.cpp. Live, a link that overflows evicts
// its oldest element, which is counted: the newest frame matters most. Before the solver, which may need longer than a
// frame time, only the newest waits. For replay and measurement the links wait instead.
#pragma once

#include "base/error.h"
#include "base/link.h"
#include "daemon/capture/frame_source.h"
#include "daemon/records/field_gaps.h"
#include "daemon/records/ledger.h"
#include "daemon/records/traction_field.h"
#include "daemon/records/turns.h"

#include <tl/expected.hpp>

#include <thread>

namespace tractiond {

/// What the stages do. Each function is called from the thread of its stage, serveSubscribers() from that of publish,
/// and never after stop() or finish(). Those that take a `timeout` sleep no longer.
class Stages {
 public:
  /// Fills the markers. Returns false if there is nothing to publish of a frame.
  virtual bool track(const Frame& frame, MarkerField& markers) = 0;
  /// Fills the field, copy of the markers included.
  virtual void solve(const MarkerField& markers, TractionField& field) = 0;
  /// Sends the field, which has kDiscontinuity where it does not follow the one before; should not wait.
  virtual void publish(const TractionField& field) = 0;
  /// Between two fields: sleeps until the descriptor is readable or the time is over, and serves subscribers meanwhile.
  virtual void serveSubscribers(int fd, std::chrono::milliseconds timeout) = 0;
  /// Takes one turn of the control thread: answers requests and does what is due.
  virtual void control(std::chrono::milliseconds /*timeout*/) {}
  /// Takes one turn of making previews.
  virtual void preview(std::chrono::milliseconds /*timeout*/) {}
  /// Takes one turn of making models for the solver.
  virtual void model(std::chrono::milliseconds /*timeout*/) {}
  /// Takes one turn of recording; the last turn is over when finish() returns.
  virtual void record(std::chrono::milliseconds /*timeout*/) {}
  /// Called by each thread that a frame passes before its first turn; all have when start() returns.
  virtual void enter() {}

 protected:
  ~Stages() = default;
};

struct PipelineOptions {
  int markers = 0;                                    ///< number of markers in the records; 0: nothing is tracked
  int nodes = 0;                                      ///< number of nodes in the records
  Counter Ledger::*notTracked = &Ledger::noRestPose;  ///< counts frames for which track() returns false
  WhenFull whenFull = WhenFull::kEvictOldest;         ///< what a link does that is full; kWait: its producer waits
  std::chrono::milliseconds turn{100};  ///< no stage sleeps longer, so that stop and watchdog never wait for a frame
  bool controls = false, previews = false, makesModels = false, records = false;  ///< there is a thread for it
};

enum class Stage { kCapture, kTrack, kSolve, kPublish, kControl };

/// Thread-bound, except for the functions marked thread-safe.
class Pipeline {
 public:
  /// Allocates every record that will travel. Source, stages, ledger and turns must outlive the pipeline.
  Pipeline(capture::FrameSource& source, Stages& stages, const PipelineOptions& options, Ledger& ledger, Turns& turns);
  ~Pipeline();  ///< Calls stop().
  Pipeline(const Pipeline&) = delete;
  Pipeline& operator=(const Pipeline&) = delete;

  /// Starts the threads, and returns when those that a frame passes run. May be called once. Fails with EX_OSERR if one
  /// of them cannot be started; the others have then ended, and the source was not asked.
  tl::expected<void, Error> start();
  /// Stops in two phases: first the source is no longer asked, and each stage in turn processes what waits before it
  /// and closes the link behind it; then the threads are joined, and what is still in a link is counted as discarded.
  /// Blocks meanwhile; a stage that hangs hangs it as well. If the threads do not run, it is requestStop() alone.
  void stop();
  /// Waits until the source ends by itself or requestStop() is called, then does the same as stop(). Returns at once if
  /// the threads do not run.
  void finish();

  /// Takes one turn of a stage and counts it for the watchdog, as the stage's thread does; for callers without threads.
  /// Sleeps at most `timeout` if there is nothing to do. Returns false if the stage has ended: it must not be called
  /// again. Must not be mixed with start(), nor used with WhenFull::kWait, which would wait for the stages of other
  /// threads, nor for Stage::kControl without PipelineOptions::controls; when all stages have ended, countDiscarded()
  /// must be called.
  bool turn(Stage stage, std::chrono::milliseconds timeout);
  /// Makes capture and control end with their next turns, and previews, models and the recording; the other stages
  /// follow. Does not wait. Thread-safe.
  void requestStop() { stopping_.store(true, std::memory_order_relaxed); }
  /// Counts what is still in a link as Ledger::discardedAtStop, and gives the memory of such frames back to the source.
  /// finish() calls it when the threads are joined.
  void countDiscarded();

  /// Returns whether the pipeline is stopping or has stopped: a function that waits for another thread must give up.
  /// finish() sets this when the stages have processed what was left, stop() and requestStop() at once. Thread-safe.
  bool stopping() const { return stopping_.load(std::memory_order_relaxed); }

  /// Returns whether the source has ended by itself: there are no more frames, or it has failed. Frames may still be in
  /// the links. False after a stop that came first. Thread-safe.
  bool ended() const { return ended_.load(std::memory_order_acquire); }

 private:
  void join();
  void loop(Stage stage);
  bool captureTurn(std::chrono::milliseconds timeout);
  bool trackTurn(std::chrono::milliseconds timeout);
  bool solveTurn(std::chrono::milliseconds timeout);
  bool publishTurn(std::chrono::milliseconds timeout);
  bool controlTurn(std::chrono::milliseconds timeout);
  void repeat(void (Stages::*function)(std::chrono::milliseconds)) const;

  capture::FrameSource& source_;
  Stages& stages_;
  PipelineOptions options_;
  Ledger& ledger_;
  Turns& turns_;
  // One slot for each side and five that wait: rides out a stall of 80 ms at 60 frames/s of a stage that works them off
  // at once.
  static constexpr std::size_t kSlots = 7;
  // One that waits: solving takes as long as a frame time or more, so each further one would add as much to the age of
  // all fields (docs/decisions/0036-newest-frame.md).
  static constexpr std::size_t kSlotsOfNewest = 3;
  Link<Frame, kSlots> frames_;
  Link<MarkerField, kSlotsOfNewest> markers_;
  Link<TractionField, kSlots> fields_;
  FieldGaps gaps_;          // the publish stage's own
  Frame* frame_ = nullptr;  // the capture stage's own: to be filled
  std::atomic<bool> stopping_{false};
  std::atomic<bool> ended_{false};
  std::thread captureThread_, trackThread_, solveThread_, publishThread_, controlThread_, previewThread_, modelThread_,
      recordThread_;
};

/// Returns whether received = published + all losses. That must hold when no frame is in flight; while frames are, it
/// usually does not.
bool balanced(const Ledger& ledger);

}  // namespace tractiond
