// Writes what was found in a picture as a field.
#pragma once

#include "daemon/solve/creep_errors.h"
#include "daemon/solve/field_rules.h"
#include "daemon/solve/large_strain.h"
#include "daemon/solve/model_contacts.h"

namespace tractiond::solve {

/// The largest force that a detection limit can be, as a multiple of Factors::force_N.
inline constexpr double kLargestDetectable = 16.384;

/// Thread-bound. Allocates only when made.
class FieldWriter {
 public:
  /// `factors` and `atoms` must outlive it.
  /// \param detectionLimit_N along the surface, and into it; may be infinite
  FieldWriter(const Factors& factors, const Atoms& atoms, const sensor::Sensor& sensor, const SolveOptions& options,
              const std::array<double, 2>& detectionLimit_N);

  /// Takes the markers and their flags over, and chooses those to solve from. False: there are too few, or they are of
  /// another gel; the field then says so, and is complete.
  bool begin(const MarkerField& markers, TractionField& field);

  // After a begin() that returned true:

  /// Returns the chosen markers, and their displacements, whose noise includes that of the mechanics and of the creep.
  const UsedMarkers& used() const { return used_; }
  Displacements picture() const;

  /// Completes the field. If the estimate has failed, or a number is not finite, the field is not valid and says so.
  /// \param mixture that the estimate is the mean of
  void write(const Estimate& estimate, Mixture& mixture, TractionField& field);

 private:
  void publish(const Estimate& estimate, Mixture& mixture, TractionField& field);
  void publishForces(const Estimate& estimate, Mixture& mixture, TractionField& field);
  void publishNothing(TractionField& field);
  bool addDrift(TractionField& field) const;
  Eigen::Matrix<double, 6, 6> unseen(const sensor::Points& nodes, const std::array<double, 2>& detectionLimit_N) const;

  const Factors& factors_;
  const Atoms& atoms_;
  const double mechanicsError_;  ///< relative, of displacements
  const double minPressForCentre_N_;
  LargeStrain strain_;
  const Eigen::Vector4d motion_;  ///< standard deviations of its prior
  const double least_N_;          ///< least force of a contact without a patch
  const SystematicPart systematic_;
  ModelContacts contacts_;
  WrenchCovariance unseen_{};  ///< of forces that may act although none is found
  // Of one frame.
  CreepErrors creep_;
  UsedMarkers used_;
  std::vector<double> nodeForce_, nodeDeviation_;  ///< 3N
};

}  // namespace tractiond::solve
