// Carries out the steps of a calibration and keeps what has been measured.
#pragma once

#include "base/error.h"
#include "daemon/calibrate/contact_fit.h"
#include "daemon/calibrate/creep_reading.h"
#include "daemon/calibrate/geometry_fit.h"
#include "daemon/calibrate/rest_noise.h"
#include "daemon/calibrate/stiffness_fit.h"
#include "daemon/calibrate/thickness_check.h"
#include "daemon/records/calibration.h"
#include "daemon/track/creep_memory.h"

#include <tl/expected.hpp>

#include <filesystem>
#include <memory>
#include <optional>

namespace tractiond::calibrate {

using Result = tl::expected<CalibrationReport, std::string>;  ///< the error is a sentence for the operator

/// A step that runs ends within its seconds and kGrace_s, measured by the frames' times. If no frames come, or another
/// zero comes into force, the caller must call drop(): neither is noticed here.
///
/// Steps may be repeated and come in any order; each replaces its part of the sensor in force, and what was not
/// measured stays as it is. The sensor in force itself does not change: the gel file applies from the next start. But
/// weights that are read after the gel's creep has been measured are read without what the gel remembers.
/// Thread-bound.
class Calibration {
 public:
  static constexpr double kGrace_s = 15.0;  ///< in which a step that has run its time may collect enough frames

  /// The sensor in force must outlive this.
  /// \param zeroFrames frames that the zero was averaged over: its error is in all displacements; above 0
  explicit Calibration(const sensor::Sensor& inForce, int zeroFrames = 30);
  ~Calibration();

  /// Carries out a step (kGeometry, kStiffness, kFinish) and returns its result, or begins one that looks at frames
  /// (kNoise, kWeight, kCreep, kRecovery) and returns nothing: its frames go to add(). Drops a step that runs. The
  /// first weight takes seconds of work, the first stiffness twice as many, kFinish waits for the disk. The result is
  /// an error if there is no zero (except for kStiffness and kFinish), nothing to evaluate or write, something seems to
  /// touch and `anyway` is false, the fit fails or the weights contradict each other, a weight is not above 0 or above
  /// 1e6 N or put on a body with fewer than BodySurface::kFewest columns or rows of nodes, the file cannot be written,
  /// or kRecovery does not follow kCreep. A new geometry or creep discards the weights read before.
  /// \param zero in force; nullptr: none yet; need not outlive the call
  /// \param camera sensor::MeasuredWith::text(); empty: kFinish fails
  /// \param directory for the gel file, which never replaces another
  std::optional<Result> begin(const CalibrationStep& step, const RestPose* zero, const std::string& camera,
                              const std::filesystem::path& directory);

  /// Returns whether a step looks at frames.
  bool running() const { return running_.has_value(); }

  /// Returns whether add() may take about a second with the next frame, as it may complete the reading of a weight.
  bool nextTakesLong() const;

  /// Ends the step that runs without a result; what earlier steps measured stays.
  void drop();

  /// Gives a frame to the step that runs, and to what goes on between steps: the load of kCreep, and the gel's memory.
  /// Returns its result when it ends, else nothing, also if no step runs. The result is an error if something touches
  /// (kNoise), no new weight came to rest (kWeight), the load did not stay as it must (kCreep, kRecovery), or frames
  /// came too slowly or with too few markers. See nextTakesLong(). Frames with kFewMarkers only count for the time.
  std::optional<Result> add(const MarkerField& field);

 private:
  struct Weighing;
  struct Heaviest;

  Result geometry(const RestPose& zero, bool anyway);
  std::optional<Result> noise(const MarkerField& field);
  std::optional<Result> weigh(const MarkerField& field);
  std::optional<Result> creep(const MarkerField& field);
  std::optional<Result> overdue(const MarkerField& field) const;
  Result read();
  Result stiffness();
  Result finish(const std::string& name, const std::string& camera, const std::filesystem::path& directory);
  sensor::Calibration& made();

  const sensor::Sensor& inForce_;
  const int zeroFrames_;
  sensor::Sensor candidate_;  ///< in force, with what has been measured
  bool measured_ = false;     ///< something that no file has yet
  std::string written_;       ///< the last file; empty: none
  std::vector<WeighedForce> weights_;
  std::unique_ptr<ContactFit> contactFit_;
  std::unique_ptr<ThicknessCheck> thicknessCheck_;
  std::unique_ptr<Heaviest> heaviest_;
  std::vector<float> lastWeight_px_;  ///< displacements under the weight read last; empty: none, or it was taken off

  std::optional<CalibrationStep> running_;
  std::int64_t begun_ns_ = 0;
  int frames_ = 0, unusable_ = 0;  ///< of the step; of these, without enough markers
  std::unique_ptr<RestNoiseMeter> noise_;
  std::unique_ptr<Weighing> weighing_;
  std::unique_ptr<CreepReading> creep_;         ///< from kCreep until the end of kRecovery
  std::unique_ptr<track::CreepMemory> memory_;  ///< of the creep measured here; null: that in force applies
  MarkerField withMemory_;                      ///< the last frame, by that memory
};

/// Returns the hash of everything that the gel file states except the hash itself, and of the contents of its influence
/// file, if it has one, as 32 hexadecimal digits.
std::string calibrationHash(const sensor::Sensor& sensor);

/// Fails with EX_CONFIG if a calibrated sensor's hash does not fit its contents: the file was changed by hand. Succeeds
/// for a sensor that is not calibrated.
/// \param path for the error
tl::expected<void, Error> verifyCalibration(const sensor::Sensor& sensor, const std::string& path);

}  // namespace tractiond::calibrate
