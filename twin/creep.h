// Creep: the gel yields further while it is loaded, and recovers with a delay.
#pragma once

#include "sensor/sensor.h"

#include <vector>

namespace twin {

/// Linear viscoelasticity with a constant Poisson's ratio. Each term of the creep adds share * h to the elastic
/// displacement u, with dh/dt = (u - h) / time_s. Thread-bound.
class Creep {
 public:
  /// \param markers number of markers
  Creep(std::vector<sensor::CreepTerm> terms, Eigen::Index markers);

  /// Returns whether there are no terms, so that now() stays zero.
  bool isNone() const { return terms_.empty(); }

  /// Advances to a time [s] that is not before the previous one. The first call sets the time, with h = 0. u is
  /// interpolated linearly from the last call to this one.
  /// \param elastic displacement u at `time_s`, 3 x markers [m]
  void advance(double time_s, const sensor::Points& elastic);

  /// Returns the displacement to add at the last time, 3 x markers [m]; 0 before the second call of advance(). Valid
  /// until the next advance().
  const sensor::Points& now() const { return sum_; }

 private:
  std::vector<sensor::CreepTerm> terms_;
  std::vector<sensor::Points> follow_;  ///< h of each term
  sensor::Points last_, sum_;
  double lastTime_s_ = 0.0;
  bool hasBegun_ = false;
};

}  // namespace twin
