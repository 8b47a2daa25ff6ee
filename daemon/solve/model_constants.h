// Constants of the model of contacts (docs/decisions/0020-one-inverse.md). None is in newtons or numbers of nodes: the
// model scales with the sensor.
#pragma once

#include <array>

namespace tractiond::solve {

struct ModelConstants {
  /// The modes are read in groups, the strongest first: those with singular values above each of these
  /// [n / (E pitch^2)], then the rest.
  static constexpr std::array kGroups = {512.0, 128.0, 32.0};

  /// epsilon: displacement [n] that forces of the typical size must cause in the strongest mode of a group, for the
  /// group to be read.
  static constexpr double kVisible = 0.1;

  /// z: deviations of its noise above which an atom's force is evident; also BestForce's deviations above which what
  /// is left of a picture shows more contacts.
  static constexpr double kSignificance = 4.0;

  /// BestForce's deviations from which on its atom is evident, if the picture hardly distinguishes it from others.
  static constexpr double kBroad = 4.8;

  /// beta: reach over which neighbouring atoms of a level share their prior variance [distances of neighbours].
  static constexpr double kCoupling = 0.5;

  /// epsilon: isotropic share of the covariance of an atom's prior.
  static constexpr double kTurning = 0.1;

  /// rho: relative variation of the pressure of a contact, at every scale; 1 where the picture hardly tells: beyond the
  /// nodes, and of ambiguous levels.
  static constexpr double kRoughness = 0.4;

  /// Distance around the forces that were found within which their contact may continue unseen [pitches].
  static constexpr double kAround = 3.0;

  /// Displacement of all markers together, |H_a f|, that an atom's force may cause there without being evident [n].
  static constexpr double kUnseen = 1.0;

  /// Least prior variance of the displacements that an atom causes, for the atom to be used [n^2].
  static constexpr double kFloor = 0.03;

  /// Deviations of the squared residual above its expectation, beyond which the residual is searched for more contacts.
  static constexpr double kGate = 1.0;

  /// M: the most atoms of each round; of the first search, and of the second, after the residual showed more.
  static constexpr std::array<std::array<int, 3>, 2> kMost = {{{48, 48, 128}, {96, 96, 192}}};
  static constexpr int kMostOfAnyRound = kMost[1][2];

  /// The most atoms for each patch where none is evident beside the patches: what is found differs by 0.02 deviations
  /// from that with 128, and takes half the time.
  static constexpr int kMostAlone = 24;
};

}  // namespace tractiond::solve
