// What can be chosen about the model of contacts (docs/decisions/0020-one-inverse.md); fixed for its life. Nothing here
// is in newtons or numbers of nodes: the model scales with the sensor.
#pragma once

#include "sensor/elastic/influence.h"

#include <array>

namespace tractiond::solve {

struct ModelOptions {
  /// The real block, or the paper's half-space.
  sensor::elastic::Model mechanics = sensor::elastic::Model::kBlock;

  /// Standard deviation n of a marker's centre in one frame [px], as calibrated; the frame's own scales the
  /// uncertainty.
  double noise_px = 0.018;

  /// Modes fainter than this are left out: pixels of noise per force of Young's modulus times a pitch squared. 32 makes
  /// a frame up to a quarter faster and misreads some contacts and palms.
  double faintest = 4.0;

  /// z: deviations above which an atom's force is evident; the rate of false alarms.
  double surety = 4.0;

  /// beta: how far the strengths of neighbours of a level follow each other, in their distances.
  double coupling = 0.5;

  /// epsilon: share of an atom's prior that has no direction.
  double turning = 0.1;

  /// rho: share of itself by which a contact's pressure varies, at every scale.
  double roughness = 0.4;

  /// Share of n^2 that an atom must move the markers by, to be counted in.
  double floor = 0.01;

  /// Deviations of what noise leaves, beyond which what is left is looked at again.
  double gate = 1.0;

  /// M, the most atoms in each round, the first time and when what is left showed more.
  std::array<std::array<int, 3>, 2> most = {{{48, 48, 96}, {96, 96, 192}}};
};

}  // namespace tractiond::solve
