// What zeros, calibration steps and the watch of the drift work with.
#pragma once

#include "base/clock.h"
#include "base/counter.h"
#include "base/error.h"
#include "base/mailbox.h"
#include "daemon/calibrate/calibration.h"
#include "daemon/control/requests.h"
#include "daemon/records/gel_report.h"
#include "daemon/records/marker_field.h"
#include "daemon/records/rest_drift.h"
#include "daemon/track/zero_tracker.h"

#include <tl/expected.hpp>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <future>
#include <optional>

namespace tractiond::control {

/// Part of a calibration step that takes seconds or waits for a disk. No result: the step needs frames.
using StepWork = std::function<std::optional<calibrate::Result>()>;

/// What procedures leave to the instrument. All functions are called on the control thread, and do not wait.
class ProcedureHost {
 public:
  /// Publishes the description with the zero in force, and makes a solver for it.
  virtual void describe(const RestPose& zero) = 0;
  /// Starts to write a zero into the state directory, and the previous one if there is one, on another thread. The
  /// future is ready when both are on the disk, or with the error.
  /// \param before nullptr: there is none. Neither need outlive the call.
  virtual std::future<tl::expected<void, Error>> keep(const RestPose& zero, const RestPose* before) = 0;
  /// Starts work on another thread, one piece at a time.
  virtual std::future<std::optional<calibrate::Result>> start(StepWork work) = 0;

 protected:
  ~ProcedureHost() = default;
};

/// Compares zeros with the gel file: GelWatch. For the control thread.
class GelComparison {
 public:
  /// Compares the gel file with a zero, which takes tens of milliseconds, and returns the result of
  /// calibrate::checkGel(). Does not publish it: report() does. Later pictures are not compared, as a load hides
  /// markers, too.
  virtual GelReport compare(const RestPose& zero) = 0;
  /// Passes what compare() has returned for a zero that comes into force to the tracker, whose fields carry
  /// kGelMismatch if the gel file does not fit, and to the status.
  virtual void report(const RestPose& zero, const GelReport& report) = 0;

 protected:
  ~GelComparison() = default;
};

struct ProcedureOptions {
  int zeroFrames = 30;                     ///< number of frames that a zero is averaged over
  std::filesystem::path directory;         ///< where a calibrated gel file goes
  std::int64_t (*clock)() = monotonicNow;  ///< [ns]
};

/// What the status reports of the procedures.
struct Watched {
  RestDrift drift;            ///< of the zero in force
  double zeroWithin_s = 0.0;  ///< a request for a zero that arrives now is answered within this time [s]
};

/// All outlive the procedures.
struct ProcedureParts {
  const sensor::Sensor& sensor;   ///< in force
  const Counter& frames;          ///< number of frames that the tracker has processed
  Mailbox<MarkerField>& markers;  ///< input: the newest
  Mailbox<Watched>& watched;      ///< output: the newest
  track::ZeroTracker& tracker;
  GelComparison& gel;
  ProcedureHost& host;
  Replies& replies;
};

}  // namespace tractiond::control
