// Completes a field whose forces are known: centre of pressure, residual, flags.
#pragma once

#include "daemon/records/traction_field.h"
#include "daemon/solve/used_markers.h"
#include "sensor/sensor.h"

#include <array>
#include <span>
#include <vector>

namespace tractiond::solve {

/// Immutable once made.
class FieldRules {
 public:
  /// Copies what it needs; neither argument need outlive it.
  FieldRules(const sensor::Sensor& sensor, const SolveOptions& options);

  /// Returns the places of the nodes, gel frame [m].
  const std::vector<std::array<double, 3>>& nodes() const { return nodes_; }

  /// Makes the field not valid, with no contacts and Method::kNone, and sets the numbers that a solver computes to 0.
  /// Leaves its markers and flags unchanged.
  static void clear(TractionField& field);

  /// Sets the centre of pressure from the field's resultant and moment, if the normal force exceeds five of its
  /// standard deviations by noise and SolveOptions::minPressForCentre_N; else only marks it as not valid.
  void centre(TractionField& field) const;

  /// Sets the residual; sets the flag kUnexplained if noise and model errors do not explain it.
  /// \param squaredResidual_px2 sum over the coordinates of the used markers; below 0 counts as 0
  /// \param markers whose last choose() returned true
  static void explain(double squaredResidual_px2, const UsedMarkers& markers, TractionField& field);

  /// Returns whether residual, resultant, moment and contacts of the field, with their uncertainty, are finite. Does
  /// not check the node forces.
  static bool finite(const TractionField& field);

 private:
  const double minPressForCentre_N_;
  std::vector<std::array<double, 3>> nodes_;
};

}  // namespace tractiond::solve
