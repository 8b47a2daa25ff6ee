// Reads what a picture shows of the modes, as far as it is needed: first the strongest, which tell whether anything
// touches.
#pragma once

#include "daemon/solve/amplitudes.h"
#include "daemon/solve/atom_products.h"
#include "daemon/solve/evidence.h"

#include <span>

namespace tractiond::solve {

/// Thread-bound. Allocates only when made.
class Modes {
 public:
  /// `factors` and `atoms` must outlive it.
  Modes(const Factors& factors, const Atoms& atoms, const ModelOptions& options);
  /// Makes another one, for another thread.
  Modes(const Modes& other);

  /// Reads the strongest modes of a picture and completes what is missing. Returns the force that alone explains it
  /// best. \param displacement_px 2M, 0 where missing; must live, as the missing coordinates of `picture`, until the
  /// next look()
  const SurestForce& look(const Displacements& picture, std::span<const float> displacement_px);
  /// Does what look() does, and returns whether anything touches. \param variance_px2 M, of a coordinate of each
  /// marker, 0 if missing: the force must be as sure by these; empty: all are alike
  bool detect(const Displacements& picture, std::span<const float> displacement_px,
              std::span<const float> variance_px2);
  /// Reads all modes in which that picture's forces are visible, and computes the moments of all atoms, all alike.
  void start(AtomMoments& moments);

  const SurestForce& surest() const { return surest_; }  ///< of the last look() or detect()
  /// Returns what it showed of each atom: V_a' S c, c its amplitudes (3A [px^2/N]).
  std::span<const double> matched() const { return evidence_.matched(); }
  /// Returns the displacements with which its missing coordinates were completed, in their order [px].
  std::span<const double> completed() const { return amplitudes_.completed(); }
  std::span<const double> amplitudes() const { return amplitudes_.values(); }  ///< of the modes that were read [px]
  Evidence& evidence() { return evidence_; }
  const std::shared_ptr<const StrongModes>& strong() const { return strong_; }

 private:
  bool readMore(double least_N);
  void complete();

  const Factors& factors_;
  const double detection_;  ///< deviations of the surest force below which nothing touches
  const std::shared_ptr<const StrongModes> strong_;
  Amplitudes amplitudes_;
  Evidence evidence_;
  SurestForce surest_;
  double noise_px_ = 0.0;
  bool isMissing_ = false;  // some coordinates are
};

}  // namespace tractiond::solve
