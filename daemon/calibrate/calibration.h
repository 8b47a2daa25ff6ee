// A calibration while it runs: what has been measured so far, and what is being measured.
#pragma once

#include "base/error.h"
#include "daemon/calibrate/contact_fit.h"
#include "daemon/calibrate/geometry_fit.h"
#include "daemon/calibrate/rest_noise.h"
#include "daemon/calibrate/stiffness_fit.h"
#include "daemon/calibrate/thickness_check.h"
#include "daemon/records/calibration.h"

#include <tl/expected.hpp>

#include <filesystem>
#include <memory>
#include <optional>

namespace tractiond::calibrate {

struct CalibrationOptions {
  int zeroFrames = 30;     ///< frames that the zero was averaged over: its error is in all displacements
  double noise_s = 5.0;    ///< duration of the noise step, unless the request states it
  double patience_s = 60;  ///< longest wait for a weight, unless the request states it
  double grace_s = 15;     ///< time beyond that, in which a step may collect enough frames
  double settle_s = 1.5;   ///< time for which a weight must have been still: most of a gel's creep is over then
  int weightFrames = 60;   ///< frames averaged after that
  double still_px = 0.02;  ///< largest smooth displacement that counts as still
  double other = 0.15;     ///< relative change of a load that makes it another weight
  sensor::elastic::Progress progress = {};  ///< called while the mechanics are computed, for the first weight
  GeometryOptions geometry = {};
  RestNoiseOptions noise = {};
  StiffnessOptions stiffness = {};
};

using Result = tl::expected<CalibrationReport, std::string>;  ///< the error is a sentence for people

/// A step that runs ends within its seconds and grace_s, by the frames' times, with a reason if it is an error; for a
/// step that gets no frames, drop() is whoever gives them's.
///
/// Steps may be repeated and come in any order; each replaces its part of the sensor in force, and what was not
/// measured stays as it is. The sensor in force itself does not change: the file counts from the next start.
/// Thread-bound.
class Calibration {
 public:
  /// The sensor in force outlives this.
  explicit Calibration(const sensor::Sensor& inForce, const CalibrationOptions& options = {});
  ~Calibration();

  /// Carries a step out, or begins it (nothing): then its frames are to be given to add(). A step that runs is
  /// dropped. The first weight takes seconds of work. \param zero in force; \param camera id; \param directory for the
  /// file.
  std::optional<Result> begin(const CalibrationStep& step, const RestPose* zero, const std::string& camera,
                              const std::filesystem::path& directory);

  bool running() const { return running_.has_value(); }

  /// Returns whether add() may take about a second with the next frame, as it may complete the reading of a weight.
  bool nextTakesLong() const;

  void drop() { running_.reset(); }

  /// A frame for the step that runs; what came of it, once it is over: then it may have taken a second of work.
  std::optional<Result> add(const MarkerField& field);

 private:
  struct Weighing;
  struct Heaviest;

  Result geometry(const RestPose& zero, bool anyway);
  std::optional<Result> noise(const MarkerField& field);
  std::optional<Result> weigh(const MarkerField& field);
  std::optional<Result> overdue(const MarkerField& field) const;
  Result read();
  Result stiffness();
  void tellThickness(CalibrationReport& report);
  Result finish(const std::string& name, const std::string& camera, const std::filesystem::path& directory);
  sensor::Calibration& made();

  const sensor::Sensor& inForce_;
  CalibrationOptions options_;
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
};

/// Of all that the file says but the hash itself: 32 hexadecimal digits.
std::string calibrationHash(const sensor::Sensor& sensor);

/// A calibrated sensor must be as it was written; one that is not calibrated always is.
tl::expected<void, Error> verifyCalibration(const sensor::Sensor& sensor, const std::string& path);

/// What a gel file calls a camera; as `tractiond --cameras` does, but for characters that TOML would have to escape.
std::string cameraId(const std::string& vendor, const std::string& serial);

}  // namespace tractiond::calibrate
