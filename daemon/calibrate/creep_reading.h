// Follows a load that is put on the gel, stays, and is taken away, and finds how the gel creeps.
#pragma once

#include "daemon/calibrate/creep_fit.h"
#include "daemon/calibrate/picture_motion.h"
#include "daemon/records/marker_field.h"
#include "sensor/sensor.h"

#include <tl/expected.hpp>

#include <optional>
#include <string>
#include <vector>

namespace tractiond::calibrate {

struct Creep {
  CreepFit fit;
  Eigen::VectorXd pattern_px;  ///< 2 M: what amount 1 displaces; 0 for markers that were not seen all the time
  std::int64_t time_ns = 0;    ///< of the last frame
  Id zero{};                   ///< from which displacements were counted
};

/// Keeps what the markers are displaced by, in the mean over ever longer times: some megabytes. Thread-bound.
class CreepReading {
 public:
  static constexpr double kPatience_s = 60.0;  ///< longest wait for the load, and for its end

  using Result = tl::expected<Creep, std::string>;  ///< the error is a sentence for the operator

  /// Waits for a load, on an untouched gel. The sensor must outlive this.
  /// \param held_s for which the load is to stay, and the gel to recover [s]
  CreepReading(const sensor::Sensor& sensor, double held_s);

  /// Adds a frame. Returns what the gel's creep is when the load has stayed for its time, and again when it has been
  /// away for as long, which takes tens of milliseconds. Returns an error if the load does not come to rest, moves,
  /// leaves too early or not at all, or something else touches; the reading is over then.
  std::optional<Result> add(const MarkerField& field);

  /// Returns whether the load has stayed for its time.
  bool hasHeld() const { return hasHeld_; }
  double held_s() const { return held_s_; }  ///< Returns what was given to the constructor.

 private:
  struct Sample {
    double from_s, to_s;
    Eigen::VectorXf sum;  ///< of displacements without the motion of the whole picture, 2 M
    int frames;
    LoadPhase phase;
  };

  std::optional<tl::expected<void, std::string>> watch(const Bulge& load, double now_s);
  void keep(Eigen::VectorXf displacement, double now_s);
  Result find() const;
  Eigen::VectorXf patternOf() const;
  Eigen::VectorXf displaced(const Sample& sample) const;
  bool isOfPattern(const Eigen::VectorXf& pattern) const;

  const sensor::Sensor& sensor_;
  const double held_s_;
  const PictureMotionFit motion_;
  LoadPhase phase_ = LoadPhase::kUntouched;
  double since_s_ = 0.0;        ///< when it began
  double loadedSize_px_ = 0.0;  ///< of the load when it has just been put on
  bool hasHeld_ = false;
  std::optional<Id> zero_;  ///< of the first frame
  std::int64_t begun_ns_ = 0, now_ns_ = 0;
  std::vector<std::uint8_t> valid_;  ///< seen all the time
  std::vector<Sample> samples_;      ///< the first one: the untouched gel
};

}  // namespace tractiond::calibrate
