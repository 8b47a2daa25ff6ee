// A gel that gives way a little more while it is loaded, and takes its time to come back.
#pragma once

#include "sensor/gel.h"

#include <vector>

namespace twin {

/// A term of the compliance's Prony series: what a load does at once grows by share (1 - exp(-t / time)).
struct CreepTerm {
  double share = 0.0;  ///< of what happens at once
  double time = 1.0;   ///< [s]
};

/// Linear viscoelasticity with a constant Poisson's ratio: with the displacement u that the elastic gel would have,
/// each term adds share h, dh/dt = (u - h) / time. Thread-bound.
class Creep {
 public:
  Creep(std::vector<CreepTerm> terms, Eigen::Index markers);

  bool isNone() const { return terms_.empty(); }

  /// To a moment that is not before the last one; u is linear in between, and was zero ever before the first.
  void advance(double time_s, const sensor::Points& elastic);

  /// What is added [m] at the last moment.
  const sensor::Points& now() const { return sum_; }

 private:
  std::vector<CreepTerm> terms_;
  std::vector<sensor::Points> follow_;  ///< h of each term
  sensor::Points last_, sum_;
  double lastTime_s_ = 0.0;
  bool hasBegun_ = false;
};

}  // namespace twin
