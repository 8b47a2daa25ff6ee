// Estimates how a gel creeps by how far a load displaces it while it stays and after it has gone.
#pragma once

#include "sensor/sensor.h"

#include <optional>
#include <vector>

namespace tractiond::calibrate {

enum class LoadPhase { kUntouched, kLoaded, kReleased };

/// Mean displacement over some time, as an amount of a pattern: all that a load displaces is proportional to it.
struct LoadReading {
  double at_s = 0.0;      ///< middle of the time
  double length_s = 0.0;  ///< length of the time; it weighs the reading
  double amount = 0.0;    ///< about 1 under the load
  LoadPhase phase = LoadPhase::kUntouched;
};

struct CreepFit {
  std::vector<sensor::CreepTerm> terms;  ///< at fixed times, which are parts of the time for which the load stays
  double load = 0.0;                     ///< amount that the load displaces at once
  double now = 0.0;                      ///< the load at the last reading, as a share of it
  Eigen::VectorXd follows;  ///< how far each term has followed the load at the last reading, as a share of it
  double error = 0.0;       ///< deviation of the amount over a second from the fit, as a share of `load`
};

/// Estimates the shares of terms. Readings while the load is put on or taken away state the load there; it must be over
/// within three seconds, and must not change later.
/// \param readings in order: untouched, loaded, released, or the former two
/// \param held_s for which the load is to stay [s]
/// \return nothing if the load does not come to rest or changes
std::optional<CreepFit> fitCreep(const std::vector<LoadReading>& readings, double held_s);

}  // namespace tractiond::calibrate
