// What is said of a field once its forces are known, whatever they were solved with.
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
  FieldRules(const sensor::Sensor& sensor, const SolveOptions& options);

  const std::vector<std::array<double, 3>>& nodes() const { return nodes_; }  ///< places [m]

  /// Makes a field that is not valid: all its numbers are 0.
  static void clear(TractionField& field);

  /// Gives the field's centre of pressure, from its wrench and noise.
  void centre(TractionField& field) const;

  /// Returns the centroid of the nodes, each weighed by the length of its force [m]; the origin if all are 0.
  Eigen::Vector3d centroid(const TractionField& field) const;

  /// Gives the residual and raises kUnexplained. `squaredResidual_px2`: over the used markers' coordinates.
  static void explain(double squaredResidual_px2, const UsedMarkers& markers, TractionField& field);

  /// Returns whether a force of the node is larger than the range in which the uncertainty is known.
  bool outOfRange(std::size_t node, double squaredForce_N2) const;

  /// The same for a mean pressure on an area as large as a node's.
  bool outOfRange(double pressure_Pa) const { return pressure_Pa > largestPressure_Pa_; }

  static bool finite(const TractionField& field);

 private:
  const double minPressForCentre_N_, largestPressure_Pa_;
  std::vector<std::array<double, 3>> nodes_;
  std::vector<double> largestForce_N_;  // of each
};

}  // namespace tractiond::solve
