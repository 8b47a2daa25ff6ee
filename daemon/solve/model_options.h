// Constants of the model of contacts (docs/decisions/0020-one-inverse.md). None is in newtons or numbers of nodes: the
// model scales with the sensor.
#pragma once

#include "daemon/solve/options.h"

#include <algorithm>
#include <array>

namespace tractiond::solve {

struct ModelOptions {
  /// Mechanics of the gel: a block of finite size, or the paper's half-space.
  sensor::elastic::Model mechanics = sensor::elastic::Model::kBlock;

  /// Standard deviation n of a marker's centre in one frame [px], as calibrated; the frame's own scales the
  /// uncertainty.
  double noise_px = 0.018;

  /// Modes with smaller singular values are left out [n / (E pitch^2)]. 32 makes a frame up to a quarter
  /// faster and misreads some contacts and palms.
  double faintest = 4.0;

  /// The modes are read in groups, the strongest first: those with singular values above each of these
  /// [n / (E pitch^2)], then the rest.
  std::array<double, 3> groups = {512.0, 128.0, 32.0};

  /// epsilon: displacement [n] that forces of the typical size must cause in the strongest mode of a group, for the
  /// group to be read.
  double visible = 0.1;

  /// z: deviations of its noise above which an atom's force is evident; also SurestForce's deviations above which what
  /// is left of a picture shows more contacts.
  double surety = 4.0;

  /// Share of the frames without a touch that show one, by noise alone: sets the deviations of SurestForce below which
  /// nothing touches (detectionThreshold()).
  double falseAlarms = 10.0 / (3600.0 * 60.0);

  /// SurestForce's deviations from which on its atom is evident, if the picture hardly distinguishes it from others.
  double broad = 4.8;

  /// beta: reach over which neighbouring atoms of a level share their prior variance [distances of neighbours].
  double coupling = 0.5;

  /// epsilon: isotropic share of the covariance of an atom's prior.
  double turning = 0.1;

  /// rho: relative variation of the pressure of a contact, at every scale; 1 where the picture hardly tells: beyond the
  /// nodes, and of ambiguous levels.
  double roughness = 0.4;

  /// Distance around the forces that were found within which their contact may continue unseen [pitches].
  double around = 3.0;

  /// Displacement of all markers together, |H_a f|, that an atom's force may cause there without being evident [n].
  double unseen = 1.0;

  /// Least prior variance of the displacements that an atom causes, for the atom to be used [n^2].
  double floor = 0.03;

  /// Deviations of the squared residual above its expectation, beyond which the residual is searched for more contacts.
  double gate = 1.0;

  /// M: the most atoms of each round; of the first search, and of the second, after the residual showed more.
  std::array<std::array<int, 3>, 2> most = {{{48, 48, 128}, {96, 96, 192}}};

  /// The most atoms for each patch where none is evident beside the patches: what is found differs by 0.02 deviations
  /// from that with 128, and takes half the time.
  int mostAlone = 24;

  /// Returns the most atoms of any round.
  int mostOfAnyRound() const {
    int largest = 0;
    for (const auto& rounds : most) largest = std::max(largest, *std::max_element(rounds.begin(), rounds.end()));
    return largest;
  }
};

/// Returns those of a daemon that solves with `options`.
inline ModelOptions modelOptions(const SolveOptions& options) {
  ModelOptions model;
  model.mechanics = options.model;
  model.noise_px = options.noise_px;
  model.falseAlarms = options.falseAlarmsPerHour / (3600.0 * options.frameRate_Hz);
  return model;
}

}  // namespace tractiond::solve
